"""Draws the data in the folder of this file with matplotlib, into a PDF."""
import csv
import json
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

here = Path(__file__).resolve()
plt.style.use(here.with_name("asperity.mplstyle"))
