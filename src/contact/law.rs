//! What a pair of surfaces does tangentially.
use crate::vector::larger;

/// mu, infinite where nothing slips, and the bound of the tangential traction at no pressure, Pa.
pub type Coefficients = [f64; 2];

/// The most that a tangential force can be at a node with this normal force and area, N.
pub fn largest_force([friction, shear]: Coefficients, force: f64, area: f64) -> f64 {
    friction * larger(force, 0.0) + shear * area
}

/// The law of a pair.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Law {
    /// No tangential force.
    #[default]
    Frictionless,
    /// Amontons and Coulomb: |q| <= mu p; where it slips q = mu p against the slip.
    Coulomb {
        /// mu, positive; the largest where it varies with the temperature.
        friction: f64,
    },
    /// Tresca: |q| <= k wherever the surfaces touch.
    Tresca {
        /// k, Pa; the largest where it varies with the temperature.
        shear: f64,
    },
    /// Never slips while it touches.
    Rough,
    /// Bonded: neither slips nor opens; what gap there is between the nodes of the meshes is kept.
    Tied,
}

impl Law {
    /// True if it has tangential forces.
    pub fn is_frictional(self) -> bool {
        self != Law::Frictionless
    }

    /// As in a case file.
    pub fn name(self) -> &'static str {
        match self {
            Law::Frictionless => "frictionless",
            Law::Coulomb { .. } => "coulomb",
            Law::Tresca { .. } => "tresca",
            Law::Rough => "rough",
            Law::Tied => "tied",
        }
    }

    /// mu; infinite where nothing slips.
    pub fn friction(self) -> f64 {
        match self {
            Law::Frictionless | Law::Tresca { .. } => 0.0,
            Law::Coulomb { friction } => friction,
            Law::Rough | Law::Tied => f64::INFINITY,
        }
    }

    /// Bound of the tangential traction at no pressure, Pa.
    pub fn shear(self) -> f64 {
        if let Law::Tresca { shear } = self { shear } else { 0.0 }
    }

    /// mu, and k in Pa.
    pub fn coefficients(self) -> Coefficients {
        [self.friction(), self.shear()]
    }

    /// The most that |q| can be at a node in contact with the pressure `p`, Pa; `None`: any size.
    pub fn bound(self, p: f64) -> Option<f64> {
        self.friction().is_finite().then(|| largest_force(self.coefficients(), p, 1.0))
    }

    /// In a line of the log; `varies`: with the temperature.
    pub fn describe(self, varies: bool) -> String {
        match self {
            Law::Frictionless => "frictionless".into(),
            Law::Coulomb { friction } if varies => {
                format!("friction up to {friction}, over temperature")
            }
            Law::Coulomb { friction } => format!("friction {friction}"),
            Law::Tresca { shear } if varies => format!("shear up to {shear:e}, over temperature"),
            Law::Tresca { shear } => format!("shear up to {shear:e}"),
            Law::Rough => "rough".into(),
            Law::Tied => "tied".into(),
        }
    }
}
