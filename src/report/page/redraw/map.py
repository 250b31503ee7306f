# Rows of the file from the lowest. Contact in a map of gaps is nan, and black. In a map of contact: 0 none, 1 contact (of the
# continuum), 2 of the atoms only, 3 of both.
with open(here.with_suffix(".csv"), newline="") as file:
    cells = [[float(v) for v in row] for row in csv.reader(file)]
figure, axes = plt.subplots(figsize=settings["size"], layout="constrained")
axes.grid(False)
bar = settings["bar"]
if bar:
    colours = matplotlib.colormaps["cividis"].with_extremes(bad="black")
    image = axes.imshow(cells, extent=settings["extent"], cmap=colours, vmin=bar["low"], vmax=bar["high"])
    figure.colorbar(image, label=bar["label"], extend=bar["extend"])
else:
    colours = matplotlib.colors.ListedColormap(settings["colours"])
    axes.imshow(cells, extent=settings["extent"], cmap=colours, vmin=-0.5, vmax=3.5)
axes.set(**settings["axes"])
figure.savefig(here.with_name(here.stem + "-redrawn.pdf"))
