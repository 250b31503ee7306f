//! Checks of a problem and its loads. Every complaint is collected, so that all are reported at once.

use super::reduced::fits;
use super::{Body, Field, Hardness, LoadKind, Loads, Names, Problem, ReducedModel, Reduction};
use crate::interface::{CubicHalfSpace, Elastic, Law, Notation, RangeChoice};
use crate::load::Load;
use crate::method::{Heights, MethodCard, ReducedProblem};
use asperity_grid::Error;
use asperity_grid::error::Complaint;
use asperity_surface::{HeightSource, quality_warnings, seam_warning, slope_warnings};

/// Load over that of full contact from which on it is no study of full contact but a wrong unit.
const FAR_BEYOND: f64 = 10.0;

/// Full-contact pressure of a random surface over its rms gradient: the stress of full contact has an rms of half the gradient, and its
/// largest value on 10⁹ nodes is 6.5 times that.
const RANDOM_FULL_CONTACT: f64 = 3.3;

const POSITIVE: &str = "a positive number";

/// Complaints in the words of a face.
struct Complaints<'n> {
    names: &'n dyn Names,
    list: Vec<Complaint>,
}

impl Complaints<'_> {
    fn unless(&mut self, good: bool, field: Field, found: impl ToString, accepted: &str) {
        if !good {
            self.list.push(Complaint::new(self.names.name(field), found, accepted));
        }
    }

    /// Likewise of a value.
    fn value(&mut self, good: bool, (field, index): (Field, Option<usize>), value: f64, accepted: &str) {
        if !(good && value.is_finite()) {
            self.list.push(self.names.complaint(field, index, value, accepted.into()));
        }
    }

    fn positive(&mut self, field: Field, value: f64) {
        self.value(value > 0.0, (field, None), value, POSITIVE);
    }
}

/// Accepted contact fractions.
const CONTACT: &str = "a fraction of the cell between 0 and 1";

impl Problem {
    /// What is wrong with the problem and its loads, before any height is looked at; nothing for those that can be solved.
    pub fn issues(&self, loads: &Loads, names: &dyn Names) -> Vec<Complaint> {
        let mut c = Complaints { names, list: Vec::new() };
        c.positive(Field::Length, self.surface.length());
        c.positive(Field::Modulus, self.modulus);
        self.check_loads(&mut c, loads);
        if let Some(a) = &self.adhesion {
            let gamma = a.work_of_adhesion;
            c.value(gamma >= 0.0, (Field::WorkOfAdhesion, None), gamma, "a number, zero or above");
            c.positive(Field::Range, a.range);
        }
        self.check_solver(&mut c);
        self.check_non_periodic(&mut c, loads);
        self.check_hardness(&mut c, loads);
        self.check_body(&mut c);
        self.penalty_length.into_iter().for_each(|length| c.positive(Field::PenaltyLength, length));
        c.list
    }

    fn card(&self) -> &'static MethodCard {
        self.method.card()
    }

    fn extrapolates(&self) -> bool {
        self.adhesion.as_ref().is_some_and(|a| a.resolution == RangeChoice::Extrapolate)
    }

    fn check_loads(&self, c: &mut Complaints, loads: &Loads) {
        let (field, attracts) = (loads.kind.field(), self.attracts());
        let (accepted, good): (&str, fn(f64) -> bool) = match loads.kind {
            // That a gap of zero determines no load behind a hard wall is said with the reason.
            LoadKind::MeanGap if self.penalty_length.is_none() => (POSITIVE, |v| v >= 0.0),
            LoadKind::MeanGap | LoadKind::Displacement => ("zero or a positive number", |v| v >= 0.0),
            LoadKind::Contact => (CONTACT, |v| v > 0.0 && v < 1.0),
            _ if attracts => ("a number", |_| true),
            _ => ("zero (first contact) or a positive number: tension needs adhesion", |v| v >= 0.0),
        };
        for (i, value) in loads.values.iter().enumerate() {
            // Above 1 and below 100 it looks like a percentage.
            let percent = format!("{CONTACT}: {value} means {} %; did you mean {value}%?", 100.0 * value);
            let accepted = if accepted == CONTACT && (*value > 1.0 && *value < 100.0) { &percent } else { accepted };
            c.value(good(*value), (field, Some(i)), *value, accepted);
        }
        // First contact without adhesion is given by the surface alone.
        let presses = matches!(loads.kind, LoadKind::PStar | LoadKind::Pressure | LoadKind::Force);
        let zero = loads.values.iter().position(|v| *v == 0.0).filter(|_| presses && !attracts);
        if let Some(i) = zero.filter(|_| !self.card().capabilities.first_contact) {
            let accepted = "a positive number: only the method \"fast\" solves first contact";
            c.list.push(Complaint::new(c.names.entry(field, i), 0, accepted));
        }
        c.unless(
            loads.kind != LoadKind::Contact || !attracts,
            Field::Contact,
            "given with adhesion",
            "pressures or mean gaps: with adhesion several states have the same contact",
        );
        let grid = self.surface.grid();
        c.unless(
            loads.kind != LoadKind::Force || grid.ny > 1 || grid.nx == 1,
            Field::Force,
            "given with a profile",
            "pressures, or an isotropic map: a profile has no width on which a force acts",
        );
        let interface = format!("an adhesive interface, {}", c.names.name(Field::WorkOfAdhesion));
        c.unless(!loads.pull_off || attracts, Field::PullOff, "true", &interface);
        let [mean_gap, pull_off] = [Field::MeanGap, Field::PullOff].map(|field| c.names.name(field));
        let accepted = format!(
            "\"fast\" or \"auto\": no other method controls the mean gap, which {mean_gap} and {pull_off} need"
        );
        let able = !(loads.impose_gaps() || loads.pull_off) || self.card().capabilities.mean_gap;
        c.unless(able, Field::Method, format!("{:?}", self.card().id), &accepted);
    }

    fn check_solver(&self, c: &mut Complaints) {
        if let Some(t) = self.tolerance {
            c.value(t > 0.0 && t < 1.0, (Field::Tolerance, None), t, "a number between 0 and 1");
        }
        c.unless(self.max_iterations > 0, Field::MaxIterations, self.max_iterations, "at least 1");
        let gap = c.names.name(Field::InitialGap);
        c.unless(
            self.initial_gap.is_none() || !self.extrapolates(),
            Field::Resolution,
            format!("\"extrapolate\" with {gap}"),
            "another range: the coarser grids of an extrapolation cannot start there",
        );
        let Some(initial) = &self.initial_gap else { return };
        let shape = self.surface.shape();
        let finite = initial.iter().all(|g| g.is_finite());
        c.unless(
            initial.len() == self.surface.grid().points() && finite,
            Field::InitialGap,
            format!("{} values, finite: {finite}", initial.len()),
            &format!("finite gaps {shape:?}, as the surface has"),
        );
    }

    fn check_non_periodic(&self, c: &mut Complaints, loads: &Loads) {
        if self.body != Body::NonPeriodic {
            return;
        }
        let names = c.names;
        for (hinders, what, accepted) in [
            (
                !self.card().capabilities.non_periodic,
                format!("this {}", names.name(Field::Method)),
                format!("a periodic surface, or {}", names.choice(Field::Method, "fast")),
            ),
            (
                loads.impose_gaps(),
                "a mean gap or a displacement".to_string(),
                "a periodic surface, or load control".to_string(),
            ),
            (
                self.extrapolates(),
                names.choice(Field::Resolution, "extrapolate"),
                "a periodic surface, or another range".to_string(),
            ),
        ] {
            c.unless(!hinders, Field::Periodic, format!("false with {what}"), &accepted);
        }
    }

    /// A hardness, and what cannot be combined with it.
    fn check_hardness(&self, c: &mut Complaints, loads: &Loads) {
        let names = c.names;
        let field = match &self.hardness {
            None => return,
            Some(Hardness::Uniform(hardness)) => {
                c.positive(Field::Hardness, *hardness);
                Field::Hardness
            }
            Some(Hardness::Map(_)) => Field::HardnessMap,
        };
        let accepted = format!("{}: a map has no gap of first flow behind a soft wall", names.name(Field::Hardness));
        let wall = names.choice(Field::Wall, "penalty");
        let soft_map = field == Field::HardnessMap && self.penalty_length.is_some();
        c.unless(!soft_map, field, format!("given with {wall}"), &accepted);
        c.unless(
            self.card().capabilities.hardness,
            field,
            format!("given with the method {}", self.card().id),
            "none, or a method that models plastic flow: fast, gfmd, bvm",
        );
        let resolution = names.choice(Field::Resolution, "extrapolate");
        c.unless(!self.extrapolates(), field, format!("given with {resolution}"), "another range");
        let gap = names.name(Field::InitialGap);
        let accepted = "none: a gap has no history of flow";
        c.unless(self.initial_gap.is_none(), field, format!("given with {gap}"), accepted);
        c.unless(
            !loads.impose_gaps() && !loads.pull_off && loads.kind != LoadKind::Contact,
            field,
            "given with a mean gap, a displacement, a contact fraction or a pull-off",
            "loads as pressure, force or p*: searches for other loads would leave flow behind",
        );
    }

    fn check_body(&self, c: &mut Complaints) {
        match self.body {
            Body::HalfSpace | Body::NonPeriodic => {}
            Body::Layer { thickness, poisson, .. } => {
                c.positive(Field::Thickness, thickness);
                let good = (0.0..=0.5).contains(&poisson);
                c.value(good, (Field::LayerPoisson, None), poisson, "a Poisson's ratio from 0 to 0.5");
            }
            // The kernel checks that the crystal is stable and its stiffness a short series.
            Body::Cubic { c11, c12, c44 } => {
                let Err(Error::Input { list, .. }) = CubicHalfSpace::new(c11, c12, c44) else { return };
                for complaint in list {
                    c.list.push(match complaint.key.as_str() {
                        "C11" => c.names.complaint(Field::C11, None, c11, complaint.accepted),
                        "C44" => c.names.complaint(Field::C44, None, c44, complaint.accepted),
                        other => {
                            let key = format!("{}, {other}", c.names.name(Field::Crystal));
                            Complaint { key, ..complaint }
                        }
                    });
                }
            }
        }
    }
}

/// What is doubtful about a problem.
impl Problem {
    /// What the grid leaves out of the spectrum, slopes and maps that suggest a wrong unit, a range of the adhesion that the grid
    /// does not resolve.
    pub fn surface_warnings(&self, reduction: &Reduction) -> Vec<String> {
        let model = &reduction.model;
        let of_surface: Vec<String> = match self.surface.source() {
            HeightSource::Synthesised { modes, .. } => modes.left_out_by(model.grid).into_iter().collect(),
            HeightSource::Imported { grid, heights, .. } => {
                let seam = seam_warning(*grid, heights).filter(|_| self.body != Body::NonPeriodic);
                quality_warnings(*grid, heights).into_iter().chain(seam).collect()
            }
            HeightSource::Fourier { .. } => Vec::new(),
        };
        let of_range = model.resolution.resolution_warning(model.adhesion, model.spacing());
        of_surface.into_iter().chain(slope_warnings(reduction.gradient)).chain(of_range).collect()
    }

    /// A load so far beyond full contact and a range so long that a unit is probably wrong, and a contact stress that depends on the grid.
    pub fn load_warnings(&self, reduction: &Reduction, notation: &dyn Notation) -> Vec<String> {
        let warnings = [
            self.far_load_warning(reduction, notation),
            range_warning(&reduction.model, notation),
            hardness_warning(reduction, notation),
        ];
        warnings.into_iter().flatten().collect()
    }

    fn far_load_warning(
        &self,
        Reduction { model, steps, gradient }: &Reduction,
        notation: &dyn Notation,
    ) -> Option<String> {
        let pressures = steps.iter().map(|step| match step.target {
            Load::Pressure(p) => p,
            Load::MeanGap(_) => 0.0,
        });
        let highest = pressures.fold(0.0, f64::max);
        // Cheap to see for nearly all loads; the exact pressure takes two transforms.
        if highest <= FAR_BEYOND * RANDOM_FULL_CONTACT * gradient {
            return None;
        }
        let full = match fits(model.grid) {
            true => {
                // The parts of a surface that is not periodic need at most the pressure of its periodic repetition.
                let kernel = match model.kernel {
                    Elastic::NonPeriodic(_) => Elastic::HalfSpace,
                    kernel => kernel,
                };
                let heights = self.surface.source().heights(model.grid, 0.0);
                ReducedProblem { kernel, ..ReducedProblem::new(model.grid, Heights::Nodes(&heights)) }
                    .full_contact_pressure()
            }
            false => RANDOM_FULL_CONTACT * gradient,
        };
        // A flat surface is in full contact under any load.
        (full > 0.0 && highest > FAR_BEYOND * full).then(|| {
            let times = highest / full;
            let [highest, full] = [highest, full].map(|p| notation.stress(p));
            format!(
                "the highest load, a mean pressure of {highest}, is {times:.2e} times the pressure of full contact, {full}: check the units of \
                 load and modulus"
            )
        })
    }
}

/// An attraction that hardly changes over any gap of the cell.
fn range_warning(model: &ReducedModel, notation: &dyn Notation) -> Option<String> {
    let range = model.adhesion.range();
    (range > 1.0).then(|| {
        let [range, cell] = [range, 1.0].map(|length| notation.length(length));
        format!("the range of the adhesion, {range}, is longer than the cell, {cell}: check its unit")
    })
}

/// Where the body flows it carries the hardness and the attraction, of which the range used on the grid decides.
fn hardness_warning(Reduction { model, .. }: &Reduction, notation: &dyn Notation) -> Option<String> {
    let used = model.resolution.law(model.adhesion, model.spacing());
    model.hardness.as_ref().filter(|_| used != model.adhesion)?;
    let [wanted, used] = [model.adhesion, used].map(|law| law.traction(0.0));
    // A law without attraction at contact has nothing that depends on the range there.
    (wanted != used).then(|| {
        let [wanted, used] = [wanted, used].map(|stress| notation.stress(stress));
        format!(
            "hardness with adhesion: the body flows at a net stress of the hardness on any grid, but its contact stress there, the hardness \
             plus the attraction at contact, depends on the range that this grid uses: an attraction of {used}, with the requested range \
             {wanted}"
        )
    })
}
