//! Stress below the surface of an isotropic body under the pressure on it.
//!
//! A half-space or a layer is that of a periodic cell, whose mean strain along the surface is zero: the mean pressure p
//! causes the stresses `-ν/(1-ν) p` along it. All other waves have the stresses of [`WaveStress`]. Below a surface that is
//! not periodic each node is a rectangle under uniform pressure.

use super::layer_interior::WaveStress;
use super::rectangle;
use super::{Elastic, Layer};
use asperity_grid::{Field, Grid, HalfSpectrum, Transform, next_fast_len};
use rayon::prelude::*;
use rustfft::num_complex::Complex;

/// Stresses xx, yy, zz, xy, xz, yz over E*, tension positive, z the depth; each `[ny, nx]`.
#[derive(Debug, Clone, PartialEq)]
pub struct StressField(pub [Vec<f64>; 6]);

impl StressField {
    /// Equivalent stress after von Mises, `√(3 J₂)`, and largest shear stress, half the difference of the largest and the
    /// smallest principal stress, at node `i`.
    pub fn equivalent(&self, i: usize) -> [f64; 2] {
        let [xx, yy, zz, xy, xz, yz] = self.0.each_ref().map(|c| c[i]);
        let mean = (xx + yy + zz) / 3.0;
        let [a, b, c] = [xx - mean, yy - mean, zz - mean];
        let j2 = 0.5 * (a * a + b * b + c * c) + xy * xy + xz * xz + yz * yz;
        if j2 == 0.0 {
            return [0.0; 2];
        }
        let j3 = a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz);
        // Angle of Lode: the principal deviators are 2√(J₂/3) cos(θ + 2πk/3).
        let cosine = (0.5 * j3 * (3.0 / j2).powf(1.5)).clamp(-1.0, 1.0);
        let angle = cosine.acos() / 3.0;
        [(3.0 * j2).sqrt(), j2.sqrt() * (angle + std::f64::consts::FRAC_PI_3).sin()]
    }
}

/// What is computed below the surface.
#[derive(Debug, Clone, PartialEq)]
pub struct SubsurfaceRequest {
    /// Depths, L.
    pub depths: Vec<f64>,
    /// Poisson's ratio of the body.
    pub poisson: f64,
    /// Shear stress over E* at which the body yields, if it is known.
    pub shear_strength: Option<f64>,
}

/// The stresses below a surface, depth by depth.
pub struct Subsurface {
    body: SubsurfaceBody,
    poisson: f64,
    /// Grid of the pressure.
    facing: Grid,
    transform: Transform<f64>,
    /// Transform of the pressure over the number of points.
    pressure: HalfSpectrum<f64>,
}

#[derive(Clone, Copy)]
enum SubsurfaceBody {
    HalfSpace,
    Layer(Layer),
    /// A half-space that is free around the surface.
    Patch,
}

impl Subsurface {
    /// Below a pressure `[ny, nx]` (E*, compression positive). The Poisson's ratio is that of a half-space; a layer has its own.
    /// `None` for a crystal, whose stresses these are not.
    pub fn new(grid: Grid, body: Elastic, poisson: f64, pressure: Field) -> Option<Self> {
        let (body, poisson, cell) = match body {
            Elastic::HalfSpace => (SubsurfaceBody::HalfSpace, poisson, grid),
            Elastic::Layer(layer) => (SubsurfaceBody::Layer(layer), layer.poisson, grid),
            Elastic::NonPeriodic(_) => (SubsurfaceBody::Patch, poisson, padded(grid)),
            Elastic::Cubic(_) => return None,
        };
        let transform = Transform::new(cell);
        let (mut spectrum, per_point) = (transform.spectrum(), 1.0 / cell.points() as f64);
        let fill = |y: usize, row: &mut [f64]| {
            row.fill(0.0);
            if y < grid.ny {
                row[..grid.nx]
                    .iter_mut()
                    .enumerate()
                    .for_each(|(x, to)| *to = pressure.at(y * grid.nx + x) * per_point);
            }
        };
        transform.forward_of(&fill, &mut spectrum);
        Some(Subsurface { body, poisson, facing: grid, transform, pressure: spectrum })
    }

    /// Bytes for a pressure on this grid, the stresses of a depth included.
    pub fn bytes(grid: Grid, body: Elastic) -> u64 {
        let (cell, padding) = match body {
            Elastic::NonPeriodic(_) => (padded(grid), 2),
            _ => (grid, 0),
        };
        // The pressure's spectrum and a working one, and with padding a kernel with its spectrum.
        let field = (size_of::<f64>() * cell.points()) as u64;
        (2 + padding) * Transform::<f64>::spectrum_bytes(cell).max(field)
            + 6 * (size_of::<f64>() * grid.points()) as u64
    }

    /// Poisson's ratio.
    pub fn poisson(&self) -> f64 {
        self.poisson
    }

    /// The stresses at a depth (L) from 0 to the thickness of the layer.
    pub fn at(&self, depth: f64) -> StressField {
        StressField([0, 1, 2, 3, 4, 5].map(|component| match self.body {
            SubsurfaceBody::Patch => self.below_rectangles(component, depth),
            _ => self.below_waves(component, depth),
        }))
    }

    /// Stresses of a wave.
    fn wave(&self, q: f64, depth: f64) -> WaveStress {
        match self.body {
            SubsurfaceBody::Layer(layer) => layer.stress_at(q, depth),
            _ => WaveStress::in_half_space(q, depth),
        }
    }

    /// Amplitude of a component under the wave (qx, qy) of unit amplitude.
    fn amplitude(&self, component: usize, (qx, qy): (f64, f64), depth: f64) -> Complex<f64> {
        let q = qx.hypot(qy);
        if q == 0.0 {
            let along = -self.poisson / (1.0 - self.poisson);
            return [along, along, -1.0, 0.0, 0.0, 0.0][component].into();
        }
        let WaveStress { normal, along, shear } = self.wave(q, depth);
        // Plane strain across the wave vector.
        let across = self.poisson * (along + normal);
        let (c, s) = (qx / q, qy / q);
        match component {
            0 => (c * c * along + s * s * across).into(),
            1 => (s * s * along + c * c * across).into(),
            2 => normal.into(),
            3 => (c * s * (along - across)).into(),
            4 => Complex::new(0.0, c * shear),
            _ => Complex::new(0.0, s * shear),
        }
    }

    fn below_waves(&self, component: usize, depth: f64) -> Vec<f64> {
        let grid = self.facing;
        let mut spectrum = self.transform.spectrum();
        spectrum.copy_from_slice(&self.pressure);
        let mut field = vec![0.0; grid.points()];
        // A wave of two nodes has no direction: shear that is odd along it vanishes.
        let (odd_along_x, odd_along_y) = (matches!(component, 3 | 4), matches!(component, 3 | 5));
        let filter = |i: usize, column: &mut [Complex<f64>]| {
            let qx = grid.qx(i);
            for (j, c) in column.iter_mut().enumerate() {
                let vanishes = (odd_along_x && 2 * i == grid.nx) || (odd_along_y && 2 * j == grid.ny);
                *c *= if vanishes { Complex::default() } else { self.amplitude(component, (qx, grid.qy(j)), depth) };
            }
            0.0
        };
        self.transform.inverse_after(&mut spectrum, &mut field, &filter);
        field
    }

    fn below_rectangles(&self, component: usize, depth: f64) -> Vec<f64> {
        let (cell, facing) = (self.transform.grid(), self.facing);
        let spacing = [facing.dx(), facing.dy()];
        // Distance of two nodes, of either sign.
        let lag = |k: usize, n: usize, cell: usize| if k < n { k as f64 } else { k as f64 - cell as f64 };
        let mut kernel = self.transform.spectrum();
        let fill = |y: usize, row: &mut [f64]| {
            for (x, to) in row.iter_mut().enumerate() {
                let point = [lag(x, facing.nx, cell.nx) * spacing[0], lag(y, facing.ny, cell.ny) * spacing[1], depth];
                *to = rectangle::stresses(self.poisson, point, spacing)[component];
            }
        };
        self.transform.forward_of(&fill, &mut kernel);
        kernel.par_iter_mut().zip(self.pressure.par_iter()).for_each(|(k, p)| *k *= p);
        let mut field = vec![0.0; cell.points()];
        self.transform.inverse(&mut kernel, &mut field);
        field.chunks(cell.nx).take(facing.ny).flat_map(|row| row[..facing.nx].iter().copied()).collect()
    }
}

/// A cell in which the images of a surface do not reach it.
fn padded(grid: Grid) -> Grid {
    let [nx, ny] = [grid.nx, grid.ny].map(|n| next_fast_len(2 * n));
    Grid { nx, ny, lx: nx as f64 * grid.dx(), ly: ny as f64 * grid.dy() }
}

impl Elastic {
    /// Largest depth of the body, L; infinite for a half-space.
    pub fn thickness(&self) -> f64 {
        match self {
            Elastic::Layer(layer) => layer.thickness,
            _ => f64::INFINITY,
        }
    }
}
