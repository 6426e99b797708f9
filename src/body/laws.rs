//! The laws of a body's materials.
use crate::{
    case::{BodyCase, PlasticityCase},
    element::PointLaw,
    material::{Analysis, ElastoPlastic, LinearElastic, PointResponse, PointState, Tangent},
    mesh::Cell,
    vector::larger,
};

/// By [`Cell::material`].
pub struct Laws(Vec<Law>);

/// Of one material.
pub struct Law {
    /// Below yield.
    pub elastic: LinearElastic,
    plastic: Option<ElastoPlastic>,
}

impl Laws {
    /// From the case, whose reader has checked that all materials of a heated body count their strains from one temperature.
    pub fn new(case: &BodyCase, analysis: Analysis, plasticity: &PlasticityCase) -> Laws {
        let law = |material| Law {
            elastic: LinearElastic::new(material, analysis),
            plastic: ElastoPlastic::new(material, analysis, plasticity.theory),
        };
        Laws(case.materials().map(law).collect())
    }

    /// Of a cell.
    pub fn of(&self, cell: &Cell) -> &Law {
        &self.0[usize::from(cell.material)]
    }

    /// True if one of them yields.
    pub fn yield_somewhere(&self) -> bool {
        self.0.iter().any(|law| law.plastic.is_some())
    }

    /// See [`LinearElastic::scaled_temperature`].
    pub fn scaled_temperature(&self, t: f64, factor: f64) -> f64 {
        self.0[0].elastic.scaled_temperature(t, factor)
    }

    /// True if the stiffness varies with temperature.
    pub fn stiffness_varies(&self) -> bool {
        self.0.iter().any(|law| law.elastic.stiffness_varies())
    }

    /// True if all thermal strains are proportional to T - Tref.
    pub fn expands_linearly(&self) -> bool {
        self.0.iter().all(|law| law.elastic.expands_linearly())
    }

    /// The largest [`LinearElastic::plane_modulus`], Pa.
    pub fn plane_modulus(&self) -> f64 {
        self.0.iter().fold(0.0, |most, law| larger(most, law.elastic.plane_modulus()))
    }

    /// The largest stiffness against a strain of the plane, H11, at the reference temperature, Pa.
    pub fn stiffness(&self) -> f64 {
        self.0.iter().fold(0.0, |most, law| larger(most, law.elastic.law(None).h[0][0]))
    }
}

impl Law {
    /// See [`ElastoPlastic::respond`].
    pub fn respond(
        &self,
        strain: [f64; 3],
        old: &PointState,
        temperature: Option<f64>,
        tangent: Tangent,
    ) -> PointResponse {
        if let Some(plastic) = &self.plastic {
            return plastic.respond(strain, old, temperature, tangent);
        }
        let state = PointState { stress: self.elastic.stress(strain, temperature), ..*old };
        PointResponse {
            law: self.elastic.law(temperature),
            strain: self.elastic.strain(strain, temperature),
            state,
            yields: false,
        }
    }

    /// See [`ElastoPlastic::yield_ratio`]; 0 of a material that does not yield.
    pub fn yield_ratio(&self, state: &PointState, temperature: Option<f64>) -> f64 {
        self.plastic.as_ref().map_or(0.0, |plastic| plastic.yield_ratio(state, temperature))
    }

    /// See [`ElastoPlastic::frozen`].
    pub fn frozen(&self, old: &PointState, temperature: Option<f64>) -> PointLaw {
        match &self.plastic {
            Some(plastic) => plastic.frozen(old, temperature),
            None => self.elastic.law(temperature),
        }
    }

    /// See [`ElastoPlastic::held`].
    pub fn held(&self, state: &PointState, temperature: Option<f64>) -> [f64; 3] {
        self.plastic.as_ref().map_or([0.0; 3], |plastic| plastic.held(state, temperature))
    }
}
