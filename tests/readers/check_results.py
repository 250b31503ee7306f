"""Opens results.nc of a run folder as a user would, and holds it against the run's other files."""

import json
import pathlib
import sys

import h5py
import netCDF4
import numpy as np
import xarray

folder = pathlib.Path(sys.argv[1])
results = json.loads((folder / "results.json").read_text())
states = results["continuum"]["states"]
length, modulus = results["scales"]["length_m"], results["scales"]["modulus_pa"]
n = results["surface"]["nx"]
stored = [k for k, s in enumerate(states) if s.get("gap_map")]
along = "load" if len(stored) == len(states) else "map_load"

# Maps and curves as the run's other files have them, in SI units.
maps = {
    "heights": np.load(folder / results["surface"]["heights"]) * length,
    "gap": np.array([np.load(folder / states[k]["gap_map"]) for k in stored]) * length,
    "stress": np.array([np.load(folder / states[k]["stress_map"]) for k in stored]) * modulus,
    "contact": np.array([np.load(folder / states[k]["gap_map"]) <= 0 for k in stored]).astype("u1"),
}
curves = {
    "p_star": [s["p_star"] for s in states],
    "pressure": [s["pressure"] for s in states],
    "contact_area": [s["contact_area"] for s in states],
    "contact_nodes": [s["contact_nodes"] for s in states],
    "mean_gap": [s["mean_gap"] for s in states],
    "stiffness": [np.nan if s.get("stiffness") is None else s["stiffness"] for s in states],
    "hydraulic_gap_effective_medium": [s["observed"]["hydraulic_gap"] for s in states],
}
units = {"gap": "m", "stress": "Pa", "pressure": "Pa", "mean_gap": "m", "x": "m", "p_star": "1", "stiffness": "Pa m-1"}
units["hydraulic_gap_effective_medium"] = "m"
x = np.arange(n) * length / n

with h5py.File(folder / "results.nc") as file:
    for name, expected in (maps | curves).items():
        np.testing.assert_allclose(file[name][...], expected, rtol=1e-15, err_msg=name)
    assert file["contact"].dtype == "u1" and file["gap"].dtype == "<f8"
    assert [d.keys() for d in file["gap"].dims] == [[along], ["y"], ["x"]]
    assert file["x"].is_scale and len(file["x"].attrs["REFERENCE_LIST"]) >= 4
    np.testing.assert_allclose(file["gap"].dims[2]["x"][...], x, rtol=1e-15)
    # h5py hands texts of NetCDF files out as bytes.
    assert file.attrs["title"].decode() == results["name"]
    assert file.attrs["description"].decode() == results["description"]
    assert file.attrs["length_m"] == length

    # Additional solutions have their own loads.
    for prefix, other in (("non_adhesive_", results.get("non_adhesive")), ("range_1_", (results.get("other_ranges") or [None])[0])):
        assert (f"{prefix}mean_gap" in file) == (other is not None)
        if other:
            gaps = [s["mean_gap"] for s in other["states"]]
            np.testing.assert_allclose(file[f"{prefix}mean_gap"][...], gaps, rtol=1e-15)
            assert [list(d.keys()) for d in file[f"{prefix}mean_gap"].dims] == [[f"{prefix}load"]]

with xarray.open_dataset(folder / "results.nc", engine="h5netcdf") as data:
    assert data.attrs["description"] == results["description"]
    assert data.gap.dims == (along, "y", "x") and data.heights.dims == ("y", "x") and data.p_star.dims == ("load",)
    assert list(data["load"].values) == [1.0, 2.0, 3.0]
    for name, unit in units.items():
        assert data[name].attrs["units"] == unit, name
        assert data[name].attrs["long_name"], name
    np.testing.assert_allclose(data.x.values, x, rtol=1e-15)
    np.testing.assert_array_equal(data[along].values, [k + 1 for k in stored])
    at = data.gap.sel({along: 2}).sel(x=x[5], y=x[7], method="nearest")
    np.testing.assert_allclose(float(at), maps["gap"][stored.index(1), 7, 5], rtol=1e-15)
    fractions = [states[k]["contact_nodes"] for k in stored]
    np.testing.assert_allclose(data.contact.mean(("y", "x")), fractions, rtol=1e-12)
    # Densities times widths, and the delta of the contact, are all nodes: bins of equal width.
    for name in ("gap", "stress"):
        middle, density = data[f"{name}_middle"].values, data[f"{name}_density"].values
        width = middle[:, 1] - middle[:, 0]
        whole = [s["observed"][name] for s in states]
        shares = [sum(d["fractions"]) for d in whole]
        np.testing.assert_allclose((density * width[:, None]).sum(axis=1), shares, rtol=1e-9)
    share = data.cluster_cumulative_fraction.values
    for k, state in enumerate(states):
        rows = state["observed"]["cluster_area"]
        np.testing.assert_allclose(share[k, : len(rows)], [r[1] for r in rows], rtol=1e-15)
        assert np.isnan(share[k, len(rows) :]).all()
    assert "criterion" in data.contact_area.attrs

with netCDF4.Dataset(folder / "results.nc") as data:
    assert data.variables["gap"].dimensions == (along, "y", "x")
    assert data.dimensions["x"].size == n
    np.testing.assert_allclose(data.variables["gap"][...], maps["gap"], rtol=1e-15)

print("checked: h5py, xarray, netCDF4")
