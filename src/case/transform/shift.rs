//! A case moved as a whole.
use super::box3::Box3;
use crate::{
    case::{
        BodyCase, Geometry, Insert, InsertCells, LoadKind, Region, RigidCase, RigidShape, Scalar, Temperature,
    },
    error::Result,
};

/// A translation, m.
pub(super) struct Shift(pub [f64; 3]);

impl Shift {
    /// Moves a point of two or three coordinates.
    pub fn point(&self, x: &mut [f64]) {
        std::iter::zip(x, self.0).for_each(|(x, d)| *x += d);
    }

    pub fn within(&self, within: &mut Option<Box3>) {
        within.iter_mut().flatten().for_each(|corner| self.point(corner));
    }

    pub fn body(&self, body: &mut BodyCase) -> Result<()> {
        match &mut body.geometry {
            Geometry::Gmsh { origin, .. } => {
                return Err(origin.error("a case with a mesh file cannot be translated"));
            }
            Geometry::Generated { translate, .. } => self.point(translate),
        }
        for Insert { cells, .. } in &mut body.inserts {
            if let InsertCells::Within(within) = cells {
                within.iter_mut().for_each(|corner| self.point(corner));
            }
        }
        match &mut body.temperature {
            Some(Temperature::Field(scalar)) => self.field(scalar),
            Some(Temperature::Nodal { values, .. }) => values.iter_mut().for_each(|(x, _)| self.point(x)),
            None => {}
        }
        for support in &mut body.supports {
            self.region(&mut support.region);
            support.displacement.iter_mut().flatten().for_each(|scalar| self.field(scalar));
        }
        body.loads.iter_mut().for_each(|load| self.load(&mut load.kind));
        Ok(())
    }

    pub fn rigid(&self, rigid: &mut RigidCase) {
        match &mut rigid.shape {
            RigidShape::Plane { through: x, .. } | RigidShape::Circle { center: x, .. } => self.point(x),
            RigidShape::Polyline { points } => points.iter_mut().for_each(|x| self.point(x)),
        }
    }

    fn load(&self, kind: &mut LoadKind) {
        match kind {
            LoadKind::Pressure(region, pressure) => {
                self.field(pressure);
                self.region(region);
            }
            LoadKind::Traction(region, vector) => {
                vector.iter_mut().for_each(|scalar| self.field(scalar));
                self.region(region);
            }
            LoadKind::Force(region, _) => self.region(region),
            LoadKind::BodyForce(vector) => vector.iter_mut().for_each(|scalar| self.field(scalar)),
        }
    }

    fn region(&self, region: &mut Region) {
        match region {
            Region::Point(x) => self.point(x),
            Region::Surface { within, .. } => self.within(within),
        }
    }

    fn field(&self, scalar: &mut Scalar) {
        if let Scalar::Expression(expression) = scalar {
            *expression = expression.translated(self.0);
        }
    }
}
