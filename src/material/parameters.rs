//! Material data, perhaps over temperature, and the two-dimensional idealisation.

/// The two-dimensional idealisation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Analysis {
    /// sigma_zz = 0.
    PlaneStress {
        /// Thickness, m.
        thickness: f64,
    },
    /// eps_zz = 0.
    PlaneStrain {
        /// Thickness, m.
        thickness: f64,
    },
}

impl Analysis {
    /// Thickness of the slice, m.
    pub fn thickness(self) -> f64 {
        match self {
            Analysis::PlaneStress { thickness } | Analysis::PlaneStrain { thickness } => thickness,
        }
    }
}

/// Material data. A table holds piecewise linear values over temperature, constant beyond its ends.
#[derive(Debug, Clone)]
pub struct MaterialCase {
    /// Name, for messages.
    pub name: String,
    /// Young's modulus, Pa.
    pub young: Property,
    /// Poisson's ratio.
    pub poisson: Property,
    /// Mean coefficient of expansion from the reference temperature, 1/K; `None` where no body with this material is heated.
    pub expansion: Option<Property>,
    /// Reference temperature, K.
    pub reference_temperature: f64,
    /// How it yields; `None`: never.
    pub plasticity: Option<Plasticity>,
}

/// Plasticity by von Mises' criterion.
#[derive(Debug, Clone, PartialEq)]
pub struct Plasticity {
    /// How large the yield surface is.
    pub hardening: Hardening,
    /// How it moves.
    pub kinematic: Option<Kinematic>,
}

/// Yield stress sigma_y(p, T), Pa, over the equivalent plastic strain p and the temperature.
#[derive(Debug, Clone, PartialEq)]
pub enum Hardening {
    /// sigma_y = yield_stress + modulus p; modulus 0: perfectly plastic.
    Linear {
        /// Pa.
        yield_stress: Property,
        /// Pa, not negative.
        modulus: Property,
    },
    /// Piecewise linear curves (p, sigma_y), the first at p = 0, constant beyond their ends; by temperature, K, increasing, linear
    /// between them. A single curve holds at every temperature.
    Table(Vec<(f64, Vec<(f64, f64)>)>),
    /// Ramberg and Osgood: p = offset (sigma / yield_stress)^exponent, without an elastic range.
    RambergOsgood {
        /// Stress at which p = offset, Pa.
        yield_stress: Property,
        /// Plastic strain at the yield stress, such as 0.002.
        offset: f64,
        /// n > 1.
        exponent: f64,
    },
    /// Swift: sigma_y = yield_stress (1 + p / strain)^exponent.
    Power {
        /// Pa.
        yield_stress: Property,
        /// epsilon_0 > 0.
        strain: f64,
        /// 0 < n <= 1.
        exponent: f64,
    },
}

/// Kinematic hardening: backstress rate = 2/3 modulus x plastic strain rate - recall x backstress x p rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Kinematic {
    /// C, Pa.
    pub modulus: Property,
    /// gamma of Armstrong and Frederick; 0: Prager.
    pub recall: f64,
}

/// What plastic strains follow.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Theory {
    /// Flow theory: increments of plastic strain along the deviatoric stress.
    #[default]
    Flow,
    /// Deformation theory, by variable elasticity parameters: a non-linear elastic law.
    Deformation,
}

/// A property: constant, or a table over temperature.
#[derive(Debug, Clone, PartialEq)]
pub enum Property {
    /// The same at every temperature.
    Constant(f64),
    /// (temperature K, value), temperatures strictly increasing, at least two rows.
    Table(Vec<(f64, f64)>),
}

impl Property {
    /// Value at a temperature, K: linear between rows, constant beyond the ends.
    pub fn at(&self, temperature: f64) -> f64 {
        match self {
            Property::Constant(value) => *value,
            Property::Table(rows) => {
                let i = rows.partition_point(|row| row.0 <= temperature);
                match (i, rows.len()) {
                    (0, _) => rows[0].1,
                    (i, n) if i == n => rows[n - 1].1,
                    (i, _) => {
                        let ((t0, v0), (t1, v1)) = (rows[i - 1], rows[i]);
                        v0 + (v1 - v0) * (temperature - t0) / (t1 - t0)
                    }
                }
            }
        }
    }

    /// True if it varies with temperature.
    pub fn is_table(&self) -> bool {
        matches!(self, Property::Table(_))
    }

    /// Largest value at any temperature.
    pub fn largest(&self) -> f64 {
        match self {
            Property::Constant(value) => *value,
            Property::Table(rows) => {
                rows.iter().fold(f64::NEG_INFINITY, |a, &(_, v)| if v > a { v } else { a })
            }
        }
    }
}
