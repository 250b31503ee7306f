use asperity_grid::Grid;
use asperity_grid::error::{Complaint, Error, Result};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use std::sync::Mutex;

/// Distribution of the moduli of modes; phases are uniform in both cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Amplitudes {
    /// Real and imaginary part normally distributed: a Gaussian surface. The challenge's choice.
    Gaussian,
    /// Moduli equal to the values of the spectrum, so that the rms height does not scatter.
    Fixed,
}

/// The self-affine spectrum of the contact-mechanics challenge (Müser et al. 2017, eq. 1): flat between the cell and
/// the roll-off wavelength, `q^(-2(1+H))` down to the short cut-off, zero below it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spectrum {
    /// Hurst exponent H.
    pub hurst: f64,
    /// Roll-off wavelength λ_r over the cell's extent in x.
    pub lambda_r: f64,
    /// Short cut-off wavelength λ_s over the cell's extent in x.
    pub lambda_s: f64,
    /// Root of ⟨h_x² + h_y²⟩ of the Fourier sum over the whole spectrum.
    pub rms_gradient: f64,
    pub amplitudes: Amplitudes,
}

/// Ensemble values of a spectrum on the lattice of modes of one cell, normalised to its rms gradient.
#[derive(Debug, Clone, Copy)]
pub struct Expected {
    pub rms_height: f64,
    /// Two standard deviations of the rms height over realisations (0 for fixed amplitudes).
    pub rms_height_band: f64,
    pub rms_gradient: f64,
    /// R_c = [(⟨h_xx²⟩ + ⟨h_yy²⟩)/2]^(-1/2): the definition that gives the challenge's 60 nm.
    pub curvature_radius: f64,
    /// Profile moments m0, m2, m4.
    pub m0: f64,
    pub m2: f64,
    pub m4: f64,
    /// Elastic energy per area of full contact, units of E*·L.
    pub full_contact_energy: f64,
    /// C(q) = `power_prefactor` times the relative power.
    pub power_prefactor: f64,
}

/// Modes that a sum has.
#[derive(Debug, Clone, Copy, PartialEq)]
enum ModeRange {
    /// Of at least this wavelength.
    Above(f64),
    /// Below the Nyquist modes of a grid of nx x ny points.
    On(usize, usize),
}

impl ModeRange {
    fn has(self, kx: i64, ky: i64, n: f64) -> bool {
        let below_nyquist = |k: i64, points: usize| k == 0 || 2 * k < points as i64;
        match self {
            ModeRange::Above(low_pass) => n * low_pass <= 1.0 + 1e-9,
            ModeRange::On(nx, ny) => below_nyquist(kx, nx) && below_nyquist(ky, ny),
        }
    }
}

/// Shortest cut-off over the cell's extent. Random numbers of a mode are keyed by 32-bit mode numbers; long before that, 1e4 modes
/// per side take half a minute.
pub const SHORTEST_CUT_OFF: f64 = 1e-4;

impl Spectrum {
    /// Refuses what is no spectrum of a cell.
    ///
    /// # Errors
    /// `Input`, with all values that are out of their range.
    pub fn check(&self) -> Result<()> {
        let Spectrum { hurst, lambda_r, lambda_s, rms_gradient, .. } = *self;
        // Quotients of lengths may differ in the last digits.
        let (above, below) = (1.0 + 1e-9, 1.0 - 1e-9);
        let list: Vec<Complaint> = [
            ("hurst", hurst, hurst > 0.0 && hurst <= 1.0, "a Hurst exponent above 0 and up to 1"),
            ("rms_gradient", rms_gradient, rms_gradient > 0.0 && rms_gradient.is_finite(), "a positive number"),
            ("lambda_r", lambda_r, lambda_r > 0.0 && lambda_r <= above, "above 0 and up to 1, the cell"),
            ("lambda_s", lambda_s, lambda_s >= SHORTEST_CUT_OFF * below && lambda_s <= above, "1e-4 to 1 of the cell"),
        ]
        .into_iter()
        .filter(|(_, _, good, _)| !good)
        .map(|(key, value, _, accepted)| Complaint::new(key, value, accepted))
        .collect();
        if list.is_empty() { Ok(()) } else { Err(Error::Input { place: "surface".into(), list }) }
    }

    /// The challenge's spectrum: H = 0.8, λ_r = L/5, λ_s = L/1000, rms gradient 1.
    pub const CHALLENGE: Spectrum =
        Spectrum { hurst: 0.8, lambda_r: 0.2, lambda_s: 0.001, rms_gradient: 1.0, amplitudes: Amplitudes::Gaussian };

    /// Power of a mode relative to the plateau, as a function of its number `n = |q| L/2π`.
    pub fn relative_power(&self, n: f64) -> f64 {
        // The mode at the cut-off is included; 1e-9 allows for the rounding of 1/λ_s.
        if n <= 0.0 || n * self.lambda_s > 1.0 + 1e-9 {
            0.0
        } else if n * self.lambda_r <= 1.0 {
            1.0
        } else {
            (n * self.lambda_r).powf(-2.0 * (1.0 + self.hurst))
        }
    }

    /// Largest mode number, along x and along y for a cell of the given aspect `ly/lx`.
    pub fn largest_modes(&self, aspect: f64) -> (i64, i64) {
        let n = (1.0 + 1e-9) / self.lambda_s;
        (n as i64, (n * aspect) as i64)
    }

    /// Ensemble values, by summing over every mode of the cell whose wavelength is at least `low_pass` (0 for all).
    /// The normalisation is always that of the whole spectrum.
    pub fn expected(&self, aspect: f64, low_pass: f64) -> Expected {
        self.known(aspect, ModeRange::Above(low_pass))
    }

    /// The same for the modes that a grid resolves, as in `Modes::heights`.
    pub fn expected_on(&self, grid: Grid) -> Expected {
        self.known(grid.ly / grid.lx, ModeRange::On(grid.nx, grid.ny))
    }

    /// The sums, or those of an earlier call: the points of a sweep have few spectra.
    fn known(&self, aspect: f64, kept: ModeRange) -> Expected {
        static KNOWN: Mutex<Vec<(Spectrum, f64, ModeRange, Expected)>> = Mutex::new(Vec::new());
        const MOST: usize = 16;
        let known = || KNOWN.lock().unwrap_or_else(|e| e.into_inner());
        if let Some(cached) = known().iter().find(|k| (k.0, k.1, k.2) == (*self, aspect, kept)) {
            return cached.3;
        }
        let sums = self.ensemble(aspect, kept);
        let mut known = known();
        if known.len() == MOST {
            known.remove(0);
        }
        known.push((*self, aspect, kept, sums));
        sums
    }

    fn ensemble(&self, aspect: f64, cached: ModeRange) -> Expected {
        let (kx_max, ky_max) = self.largest_modes(aspect);
        // A quarter of the lattice with weights: power depends on |q| only.
        let rows: Vec<[f64; 8]> = (0..=ky_max)
            .into_par_iter()
            .map(|ky| {
                let mut sum = [0.0; 8];
                for kx in 0..=kx_max {
                    let (nx, ny) = (kx as f64, ky as f64 / aspect);
                    let n2 = nx * nx + ny * ny;
                    let c = self.relative_power(n2.sqrt());
                    if c == 0.0 {
                        continue;
                    }
                    let w = if kx == 0 { 1.0 } else { 2.0 } * if ky == 0 { 1.0 } else { 2.0 };
                    let q = 2.0 * PI;
                    sum[0] += w * c * q * q * n2;
                    if !cached.has(kx, ky, n2.sqrt()) {
                        continue;
                    }
                    sum[1] += w * c;
                    sum[2] += w * c * q * q * n2;
                    sum[3] += w * c * q.powi(4) * (nx.powi(4) + ny.powi(4)) / 2.0;
                    sum[4] += w * c * c;
                    sum[5] += w * c * q * n2.sqrt();
                }
                sum
            })
            .collect();
        let [gradient_all, m0, gradient, m4, squares, energy, ..] = asperity_grid::block_sums(&rows);
        let scale = if gradient_all > 0.0 { self.rms_gradient.powi(2) / gradient_all } else { 0.0 };
        let relative_sd = match self.amplitudes {
            // Each ±q pair is one exponentially distributed power: Var(Σ|a|²) = 2 Σ C².
            Amplitudes::Gaussian => (2.0 * squares).sqrt() / (2.0 * m0),
            Amplitudes::Fixed => 0.0,
        };
        Expected {
            rms_height: (m0 * scale).sqrt(),
            rms_height_band: 2.0 * relative_sd * (m0 * scale).sqrt(),
            rms_gradient: (gradient * scale).sqrt(),
            curvature_radius: (m4 * scale).sqrt().recip(),
            m0: m0 * scale,
            m2: gradient * scale / 2.0,
            m4: m4 * scale,
            full_contact_energy: energy * scale / 4.0,
            power_prefactor: scale,
        }
    }
}

impl Expected {
    /// Nayak's bandwidth parameter α = m0·m4/m2².
    pub fn nayak(&self) -> f64 {
        self.m0 * self.m4 / self.m2.powi(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lattice sums of the challenge's spectrum in µm, as computed independently for the 0.1 mm cell.
    #[test]
    fn ensemble_values_of_the_challenge() {
        /// The printed digits of the reference values.
        const DIGITS: f64 = 2e-4;
        let e = Spectrum::CHALLENGE.expected(1.0, 0.0);
        let close = |actual: f64, printed: f64| assert!((actual / printed - 1.0).abs() < DIGITS, "{actual} {printed}");
        close(e.rms_height * 100.0, 0.78252);
        close(e.curvature_radius * 1e5, 60.13);
        close(e.m0 * 1e4, 0.6123);
        close(e.m2, 0.5);
        close(e.m4 * 1e-4, 276.58);
        close(e.nayak(), 677.5);
        close(e.full_contact_energy * 1e2, 0.0829 / 1.0002);
        assert!((e.rms_height_band / e.rms_height - 2.0 * 0.042).abs() < 0.004);
    }

    /// Fraction of the gradient that a coarse grid or a block of atoms resolves (band-limit table of the challenge).
    #[test]
    fn resolved_gradient_below_a_cut_off() {
        for (n, gradient) in [(5.0, 0.120), (16.0, 0.305), (64.0, 0.502), (256.0, 0.727), (512.0, 0.858)] {
            let e = Spectrum::CHALLENGE.expected(1.0, 1.0 / n);
            assert!((e.rms_gradient - gradient).abs() < 6e-4, "{n}: {}", e.rms_gradient);
        }
    }
}
