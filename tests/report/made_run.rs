//! A run folder with synthetic results for every part of a report.

use std::f64::consts::TAU;
use std::path::Path;

use asperity::atoms::results::*;
use asperity::contact::load::Branch;
use asperity::contact::method::ErrorEstimates;
use asperity::contact::observe;
use asperity::contact::quantity::Quantity;
use asperity::contact::results::*;
use asperity::contact::state::*;
use asperity::contact::uncertainty::ValueWithError;
use asperity::contact::uncertainty::{UncertaintyComponent, UncertaintySource};
use asperity::grid::Field;
use asperity::record::given_loads::GivenLoads;
use asperity::record::results::*;
use asperity::surface::files::npy;

pub(crate) const N: usize = 64;
pub(crate) const LENGTH_ANGSTROM: f64 = 400.0;
/// Cell, m, and contact modulus, Pa, of the laboratory and of the block.
pub(crate) const LABORATORY: [f64; 2] = [1e-4, 25e6];
pub(crate) const BLOCK: [f64; 2] = [LENGTH_ANGSTROM * 1e-10, 28.57e9];

/// A sum of waves with fixed phases: height over L at the position (x, y) over L.
pub(crate) fn height(x: f64, y: f64) -> f64 {
    let waves =
        [(1, 0, 0.3), (1, 2, 1.1), (-2, 3, 2.0), (4, 1, 0.2), (3, -5, 4.0), (6, 5, 5.1), (-8, 3, 0.9), (2, 9, 3.3)];
    let sum: f64 = waves
        .iter()
        .map(|&(kx, ky, phase)| {
            let k = f64::from(kx * kx + ky * ky).sqrt();
            (TAU * (f64::from(kx) * x + f64::from(ky) * y) + phase).cos() / k.powf(1.5)
        })
        .sum();
    0.01 * (sum + 2.5)
}

pub(crate) fn grid(of: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    (0..N * N).map(|i| of((i % N) as f64 / N as f64, (i / N) as f64 / N as f64)).collect()
}

pub(crate) fn store(folder: &Path, name: &str, values: &[f64]) -> Option<String> {
    npy::write(&folder.join(name), N, N, values.iter().copied()).unwrap();
    Some(name.into())
}

pub(crate) fn state(p_star: f64, gap: &[f64], files: [Option<String>; 2]) -> State {
    let share = gap.iter().filter(|g| **g == 0.0).count() as f64 / gap.len() as f64;
    let [gap_file, stress] = files;
    State {
        index: usize::from(p_star > 0.01),
        branch: if p_star > 0.01 { Branch::Unloading } else { Branch::Loading },
        p_star,
        pressure: 0.08 * p_star,
        criterion: "gap = 0".into(),
        contact_area: 0.9 * share,
        contact_area_error: Some(0.9 * share * 0.0312),
        contact_nodes: Some(share),
        clusters: Some(17),
        mean_gap: Some(gap.iter().sum::<f64>() / gap.len() as f64),
        stiffness: Some(0.345),
        energy: Some(-1e-6),
        elastic_energy: Some(1e-6),
        interaction_energy: Some(0.0),
        load_error: 2e-4,
        residual: Some(7e-5),
        complementarity: Some(1e-9),
        error_estimates: Some(ErrorEstimates { area: Some(1e-4), mean_gap: None }),
        gap_map: gap_file.map(Map::File),
        stress_map: stress.map(Map::File),
        iterations: 143,
        fft_pairs: 301.0,
        seconds: 1.7,
        discretisation: Some(Discretisation {
            area: Some(0.0234),
            area_is_bound: false,
            mean_gap: Some(0.0017),
            mean_gap_is_bound: true,
            stiffness: None,
            coarser: [N / 2, N / 2],
        }),
        extrapolated: Some(Extrapolated {
            range: 0.25,
            area: ValueWithError { value: 0.0334, error: 0.0003 },
            mean_gap: Some(ValueWithError { value: 0.01014, error: 1e-5 }),
        }),
        uncertainty: vec![
            UncertaintyComponent {
                quantity: Quantity::ContactArea,
                source: UncertaintySource::Grid,
                relative: Some(0.0234),
                is_bound: false,
            },
            UncertaintyComponent {
                quantity: Quantity::ContactArea,
                source: UncertaintySource::Solver,
                relative: Some(0.0078),
                is_bound: false,
            },
            UncertaintyComponent {
                quantity: Quantity::MeanGap,
                source: UncertaintySource::Range,
                relative: None,
                is_bound: false,
            },
            UncertaintyComponent {
                quantity: Quantity::MeanGap,
                source: UncertaintySource::Solver,
                relative: Some(1e-7),
                is_bound: false,
            },
        ],
        observed: Some(observed(gap)),
        ..State::default()
    }
}

/// Observables of a gap field, with stresses derived from the gap.
pub(crate) fn observed(gap: &[f64]) -> Observed {
    let stress: Vec<f64> = gap.iter().map(|g| 0.05 - 3.0 * g).collect();
    let (field, stress) = (Field::F64(gap), Field::F64(&stress));
    let sizes = observe::cluster_sizes(&observe::contact_map(field, 0.0), N, observe::Connectivity::Eight, true);
    let stresses = observe::stress_distribution(field, stress, (0.0, true), observe::linear_edges(-0.1, 0.1, 40));
    let node = 1.0 / (N * N) as f64;
    Observed {
        mean_contact_pressure: Some(0.03),
        gap: Some(observe::gap_distribution(field, 0.0, observe::linear_edges(0.0, 0.04, 40))),
        gap_logarithmic: Some(observe::gap_distribution(field, 0.0, observe::logarithmic_edges(1e-5, 0.04, 40))),
        stress: Some(stresses.all),
        contact_stress: Some(stresses.contact),
        cluster_density: observe::size_distribution(&sizes, 5)
            .into_iter()
            .map(|(a, density, n)| [a * node, density / node, n as f64])
            .collect(),
        cluster_area: observe::cumulative_area(&sizes).into_iter().map(|(a, share)| [a as f64 * node, share]).collect(),
        median_cluster_area: observe::median_cluster_size(&sizes).map(|a| a as f64 * node),
        constriction_conductance: Some(0.123),
        hydraulic_gap: Some(0.0),
        compressive: None,
        contact_percolates: Some([false, true]),
        gap_percolates: Some([true, true]),
    }
}

/// `unit`: m and Pa of the problem's units.
pub(crate) fn continuum(
    folder: &Path,
    (name, method): (&str, &str),
    level: f64,
    stored: [bool; 2],
    unit: [f64; 2],
) -> ContinuumResults {
    let [length, modulus] = unit;
    let states = [0.01, 0.02].iter().zip(1..).map(|(&p_star, i)| {
        let gap = grid(|x, y| (height(x, y) - level - 0.25 * p_star).max(0.0));
        let stress = grid(|x, y| (0.3 * (level + 0.25 * p_star - height(x, y))).max(-1e-4));
        let files = [
            stored[0].then(|| store(folder, &format!("{name}-gap-{i}.npy"), &gap)).flatten(),
            stored[1].then(|| store(folder, &format!("{name}-stress-{i}.npy"), &stress)).flatten(),
        ];
        state(p_star, &gap, files).in_units(length, modulus)
    });
    ContinuumResults {
        hardness: None,
        hardness_map: None,
        method: method.into(),
        kernel: "half-space".into(),
        adhesion: "exponential, γ = 2×10⁻⁵ E*L, ρ = 2.07×10⁻⁵ L".into(),
        wall: "hard wall".into(),
        nx: N,
        ny: N,
        range: Some(
            RangeResults {
                gamma: 2e-5,
                requested: 2.07e-5,
                used: 8.28e-5,
                resolution_requested: 0.35,
                resolution_used: 1.4,
            }
            .in_units(length, modulus),
        ),
        resolved_gradient: Some(0.71),
        states: states.collect(),
        pull_off: Some(
            PullOff {
                pressure: -0.0021,
                force: Some(-0.0021),
                mean_gap: 0.012,
                pressure_error: Some(3e-4),
                mean_gap_error: Some(1e-4),
                coarser: Some([N / 2, N / 2]),
                curve: vec![[0.010, 0.001], [0.012, -0.0021], [0.016, -0.0007]],
            }
            .in_units(length, modulus),
        ),
        contact_lost: None,
        pull_off_failure: None,
        dissipation: None,
        percolation: Some([0.2, 0.3]),
        onset: Default::default(),
    }
}

pub(crate) fn atoms(folder: &Path) -> AtomsResults {
    let states = [0.01, 0.02].iter().zip(1..).map(|(&p_star, i)| {
        // Shifted by two nodes, so that the superposition contains all of its colours.
        let gap = grid(|x, y| LENGTH_ANGSTROM * (height(x + 0.012, y) - 0.0083 - 0.25 * p_star).max(0.0) + 2.0);
        let flags = gap.iter().map(|g| u8::from(*g < 2.1));
        let contacts = flags.clone().map(usize::from).sum();
        npy::write(&folder.join(format!("contact-{i}.npy")), N, N, flags).unwrap();
        store(folder, &format!("atoms-gap-{i}.npy"), &gap);
        AtomState {
            index: i - 1,
            branch: Branch::Loading,
            p_star,
            contact_area: contacts as f64 / (N * N) as f64,
            contacts,
            contacts_below_surface: 0,
            mean_gap_angstrom: 9.713,
            contact_stress_gpa: 1.87,
            contact_map: format!("contact-{i}.npy"),
            gap_map: format!("atoms-gap-{i}.npy"),
            frame: Some(format!("frame-{i}.xyz")),
            indenter_shift_angstrom: 0.0,
            criteria: Vec::new(),
            sensitivity: Vec::new(),
            stress: None,
            defects: None,
        }
    });
    let history = (0..25).map(|step: u32| {
        let d = f64::from(step) * 0.2;
        LoadStepResults {
            step: step as usize,
            displacement_angstrom: d,
            load_ev_per_angstrom: d * d,
            p_star: 1.2e-3 * d * d - 0.001 * d,
            contacts: (12.0 * d * d) as usize,
            energy_ev: -1e4 + d,
            force_evaluations: 230,
            max_force_ev_per_angstrom: 8e-5,
            minimizer: if step == 7 { StepMinimizer::HarmonicCg } else { StepMinimizer::Harmonic },
            rejected: (step / 5) as usize,
            predicted_decrease_ev: (step != 7).then_some(3.1e-6),
        }
    });
    let line = |group: &str, symbol: &str, target, used, status: &str, reason: &str| AuditLine {
        group: group.into(),
        symbol: symbol.into(),
        target,
        actual: used,
        status: status.into(),
        reason: reason.into(),
    };
    AtomsResults {
        potential: "Lennard-Jones, cut at 2.5 σ".into(),
        engine: "LAMMPS (29 Sep 2021 - Update 2)".into(),
        cells: 72,
        depth_cells: 10,
        foundation_cells: 0,
        elastic_base: false,
        a0_angstrom: 5.5884,
        length_angstrom: LENGTH_ANGSTROM,
        modulus_gpa: 28.57,
        deformable: 186_624,
        fixed: 20_736,
        indenter: 10_368,
        repulsion: asperity::atoms::repulsion::Repulsion {
            epsilon_ev: 0.2145,
            sigma_angstrom: 3.5927,
            contact_distance_angstrom: 4.0354,
        },
        audit: vec![
            line("reduced work of adhesion", "γ*", 2e-5, 2e-5, "kept", "set by the depth of the wall's potential"),
            line(
                "reduced range",
                "ρ*",
                2.07e-5,
                1.1e-3,
                "unreachable",
                "a range below an ångström has no atoms to carry it",
            ),
        ],
        from_continuum: false,
        load_steps: history.collect(),
        states: states.collect(),
        unloading: None,
        nvt: None,
        plasticity: None,
    }
}

pub(crate) fn comparison(folder: &Path, atoms: &AtomsResults) -> ComparisonResults {
    let hard = continuum(folder, ("hard", "bccg"), 0.0085, [true, false], BLOCK);
    let soft = continuum(folder, ("soft", "gfmd"), 0.007, [true, false], BLOCK);
    let overlap = |kappa: f64| Overlap { jaccard: 0.8 * kappa, precision: 0.9 * kappa, recall: 0.95 * kappa, kappa };
    let maps = ["hard_wall", "offset_wall", "compliant_wall"].map(|id| {
        let name = format!("continuum-{id}.npy");
        let reach = if id == "hard_wall" { 0.0 } else { 0.002 };
        let flags = grid(|x, y| f64::from(u8::from(height(x, y) <= 0.0085 + reach)));
        npy::write(&folder.join(&name), N, N, flags.iter().map(|f| *f as u8)).unwrap();
        (id, name)
    });
    let a_match = |id: &str, offset_angstrom, contact_area, kappa| CriterionMatch {
        id: id.into(),
        criterion: format!("raised by {offset_angstrom} Å"),
        offset_angstrom,
        contact_area,
        overlap: overlap(kappa),
        shifted: overlap(0.031),
        map: maps.iter().find(|m| m.0 == id).map(|m| m.1.clone()),
    };
    let loads = atoms.states.iter().zip(&hard.states).zip(&soft.states).map(|((a, h), s)| LoadComparison {
        p_star: a.p_star,
        registration: [0, 0],
        atoms: CriterionArea { criterion: "distance < 3.62 Å".into(), contact_area: a.contact_area },
        continuum: vec![
            a_match("hard_wall", 0.0, h.contact_area, 0.71),
            a_match("offset_wall", 0.3, 1.3 * h.contact_area, 0.78),
            a_match("compliant_wall", 0.0, 1.2 * h.contact_area, 0.8347),
        ],
        atoms_mean_gap_angstrom: 9.713,
        hard_wall_mean_gap_angstrom: 9.402,
        compliant_wall_mean_gap_angstrom: 9.655,
        yielding_wall_mean_gap_angstrom: None,
        atoms_clusters: 14,
        compliant_wall_clusters: 17,
        gap_rms_difference_angstrom: Some(0.214),
        compliant_wall_gap: s.gap_file().unwrap().into(),
        model_chain: Vec::new(),
        area_vs_distance: Vec::new(),
        area_vs_gap: Vec::new(),
    });
    let y: Vec<f64> = (0..N).map(|i| i as f64 / N as f64).collect();
    let gap = |level: f64| y.iter().map(|&y| LENGTH_ANGSTROM * (height(0.5, y) - level).max(0.0)).collect::<Vec<f64>>();
    let section = |p_star: f64| GapSection {
        p_star,
        y: y.clone(),
        atoms_gap_angstrom: gap(0.0095 + 0.1 * p_star).iter().map(|g| g + 0.2).collect(),
        hard_wall_gap_angstrom: gap(0.010 + 0.1 * p_star),
        compliant_wall_gap_angstrom: gap(0.0097 + 0.1 * p_star),
        full_heights_gap_angstrom: Vec::new(),
    };
    ComparisonResults {
        loads: loads.collect(),
        sections: vec![section(0.01), section(0.02)],
        findings: vec![
            "Steps: 61 % of the atoms' extra contact lies within one lattice constant of a terrace edge.".into(),
        ],
        full_heights: None,
        hard_wall: hard,
        compliant_wall: soft,
        yielding_wall: None,
    }
}

/// A run folder with every optional output of a run.
pub(crate) fn run_folder(folder: &Path) -> Results {
    std::fs::create_dir_all(folder).unwrap();
    store(folder, "heights.npy", &grid(height));
    let statistic = |name: &str, symbol: &str, unit: &str, expected, realised, band| SurfaceStatistic {
        name: name.into(),
        symbol: symbol.into(),
        unit: unit.into(),
        expected,
        expected_on_grid: None,
        realised,
        band,
    };
    let atoms = atoms(folder);
    let results = Results {
        schema: SCHEMA,
        name: "A made-up <run>".into(),
        description: "Fields of a few waves, for looking at the report; no solver has seen them.".into(),
        scales: ScalesSi { length_m: LABORATORY[0], modulus_pa: LABORATORY[1] },
        loads: GivenLoads::P_STAR,
        surface: SurfaceResults {
            origin: "Synthesised, seed 1".into(),
            provenance: None,
            periodic: true,
            note: String::new(),
            nx: N,
            ny: N,
            aspect: 1.0,
            heights: Some("heights.npy".into()),
            statistics: vec![
                statistic("rms gradient", "ḡ", "1", Some(1.0), 0.98764, Some(0.021)),
                statistic("rms height", "h_rms", "µm", Some(0.762), 0.701, Some(0.05)),
                statistic("mean curvature", "1/R_c", "1/µm", None, 16.44, None),
            ],
            psd: (1..60)
                .map(f64::from)
                .map(|n| PsdPoint {
                    mode: n,
                    // From mode 50 on only rounding errors.
                    realised: if n < 50.0 { 1e-5 * n.powf(-3.6) * (1.0 + 0.5 * (7.0 * n).sin()) } else { 1e-37 },
                    expected: Some(1e-5 * n.powf(-3.6)),
                })
                .collect(),
        },
        continuum: Some(continuum(folder, ("laboratory", "gfmd"), 0.009, [true, true], LABORATORY)),
        accuracy: None,
        non_adhesive: None,
        other_ranges: vec![],
        cross_check: None,
        methods: vec![],
        failures: Vec::new(),
        acceptance: vec![],
        comparison: Some(comparison(folder, &atoms)),
        atoms: Some(atoms),
        stages: ["surface", "continuum", "atoms", "compare"]
            .iter()
            .zip([0.4, 12.6, 1843.0, 2.2])
            .map(|(name, seconds)| StageCost {
                name: (*name).into(),
                key: "8f3a61c9d2e4b7a0cc".into(),
                seconds,
                earlier_seconds: 0.0,
                peak_rss_bytes: 312_000_000,
                transformed_nodes: 0,
                reused: *name == "surface",
            })
            .collect(),
        warnings: vec!["The grid resolves wavelengths down to 3.1 µm; the spectrum goes down to 0.1 µm.".into()],
        sources: vec!["M. H. Müser et al., Tribology Letters 65 (2017) 118, doi:10.1007/s11249-017-0900-2".into()],
    };
    results.write(folder).unwrap();
    results
}
