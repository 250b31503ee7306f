"""Draws the frames of the atoms with OVITO (pip install ovito), in the colours of the files: contact orange, the block grey,
the indenter blue and transparent.

python ovito_frames.py        writes one PNG next to each frame atoms/load-N-frame.xyz
"""
from pathlib import Path

from ovito.io import import_file
from ovito.modifiers import ComputePropertyModifier
from ovito.vis import TachyonRenderer, Viewport

here = Path(__file__).resolve().parent
frames = sorted((here / "atoms").glob("load-*-frame.xyz"))
for frame in frames:
    pipeline = import_file(str(frame))
    pipeline.modifiers.append(ComputePropertyModifier(output_property="Transparency", expressions=["indenter ? 0.8 : 0"]))
    pipeline.compute().particles.vis.radius = 1.9
    pipeline.add_to_scene()
    view = Viewport(type=Viewport.Type.Perspective, camera_dir=(-1, -2, -1))
    view.zoom_all()
    view.render_image(filename=str(frame.with_suffix(".png")), size=(1600, 1000), renderer=TachyonRenderer())
    pipeline.remove_from_scene()
