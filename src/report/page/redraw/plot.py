curves = {}
with open(here.with_suffix(".csv"), newline="", encoding="utf-8") as file:
    for label, x, y, error in list(csv.reader(file))[1:]:
        curves.setdefault(label, []).append((float(x), float(y), float(error or 0)))
figure, axes = plt.subplots(figsize=settings["size"], layout="constrained")
for label, points in curves.items():
    x, y, error = zip(*points)
    axes.errorbar(x, y, error if any(error) else None, label=label, capsize=2, **settings["looks"][label])
axes.set(**settings["axes"])
if any(not label.startswith("_") for label in curves):
    axes.legend()
figure.savefig(here.with_name(here.stem + "-redrawn.pdf"))
