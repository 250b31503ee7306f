import numpy as np

# Rows of the files from the lowest; heights upwards, of the surface upside down.
heights = np.loadtxt(here.with_suffix(".csv"), delimiter=",", ndmin=2)
colours = np.loadtxt(here.with_name(here.stem + "-colours.csv"), delimiter=",", ndmin=2, dtype=str, comments=None)
ny, nx = heights.shape
across, up = settings["extent"]
x, y = np.meshgrid(np.arange(nx) * across / nx, np.arange(ny) * up / ny)
figure, axes = plt.subplots(figsize=settings["size"], subplot_kw={"projection": "3d"})
colours = matplotlib.colors.to_rgba_array(colours.ravel()).reshape(ny, nx, 4)
axes.plot_surface(x, y, heights, facecolors=colours, rcount=128, ccount=128)
axes.set(**settings["axes"])
figure.savefig(here.with_name(here.stem + "-redrawn.pdf"))
