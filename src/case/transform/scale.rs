//! A case in other units.
use super::box3::Box3;
use crate::case::{
    BodyCase, Geometry, Grading, InsertCells, LoadKind, MaterialCase, Property, Region, RigidCase,
    RigidShape, Scalar, Shape, Temperature,
};
use crate::material::{Hardening, Plasticity};

/// Factors on every length and every pressure.
pub(super) struct Scale {
    pub length: f64,
    pub pressure: f64,
}

impl Scale {
    pub fn body(&self, body: &mut BodyCase) {
        match &mut body.geometry {
            Geometry::Gmsh { scale, .. } => *scale *= self.length,
            Geometry::Generated { shape, translate, .. } => {
                self.shape(shape);
                scale_all(translate, self.length);
            }
        }
        self.material(&mut body.material);
        for insert in &mut body.inserts {
            self.material(&mut insert.material);
            if let InsertCells::Within(within) = &mut insert.cells {
                within.iter_mut().for_each(|corner| scale_all(corner, self.length));
            }
        }
        match &mut body.temperature {
            Some(Temperature::Field(scalar)) => self.scalar(scalar, 1.0),
            Some(Temperature::Nodal { values, .. }) => {
                values.iter_mut().for_each(|(x, _)| scale_all(x, self.length));
            }
            None => {}
        }
        for support in &mut body.supports {
            self.region(&mut support.region);
            support.displacement.iter_mut().flatten().for_each(|scalar| self.scalar(scalar, self.length));
        }
        for load in &mut body.loads {
            self.load(&mut load.kind);
        }
    }

    fn material(&self, material: &mut MaterialCase) {
        self.property(&mut material.young);
        let Some(Plasticity { hardening, kinematic }) = &mut material.plasticity else { return };
        match hardening {
            Hardening::Linear { yield_stress, modulus } => {
                self.property(yield_stress);
                self.property(modulus);
            }
            Hardening::Table(curves) => {
                curves.iter_mut().flat_map(|(_, curve)| curve).for_each(|point| point.1 *= self.pressure);
            }
            Hardening::RambergOsgood { yield_stress, .. } | Hardening::Power { yield_stress, .. } => {
                self.property(yield_stress);
            }
        }
        if let Some(kinematic) = kinematic {
            self.property(&mut kinematic.modulus);
        }
    }

    /// One with the unit of a pressure.
    pub fn property(&self, property: &mut Property) {
        match property {
            Property::Constant(value) => *value *= self.pressure,
            Property::Table(rows) => rows.iter_mut().for_each(|row| row.1 *= self.pressure),
        }
    }

    pub fn rigid(&self, rigid: &mut RigidCase) {
        scale_all(&mut rigid.motion, self.length);
        match &mut rigid.shape {
            RigidShape::Plane { through, .. } => scale_all(through, self.length),
            RigidShape::Circle { center, radius, .. } => {
                scale_all(center, self.length);
                *radius *= self.length;
            }
            RigidShape::Polyline { points } => points.iter_mut().for_each(|p| scale_all(p, self.length)),
        }
    }

    fn load(&self, kind: &mut LoadKind) {
        match kind {
            LoadKind::Pressure(region, pressure) => {
                self.scalar(pressure, self.pressure);
                self.region(region);
            }
            LoadKind::Traction(region, vector) => {
                vector.iter_mut().for_each(|scalar| self.scalar(scalar, self.pressure));
                self.region(region);
            }
            LoadKind::Force(region, force) => {
                scale_all(force, self.pressure * self.length * self.length);
                self.region(region);
            }
            LoadKind::BodyForce(vector) => {
                vector.iter_mut().for_each(|scalar| self.scalar(scalar, self.pressure / self.length));
            }
        }
    }

    fn shape(&self, shape: &mut Shape) {
        let grading = |grading: &mut Grading| scale_all(&mut grading.at, self.length);
        match shape {
            Shape::Rectangle { x, y } => {
                grading(x);
                grading(y);
            }
            Shape::Block { corners, arcs, .. } => {
                corners.iter_mut().chain(arcs.iter_mut().flatten()).for_each(|p| scale_all(p, self.length));
            }
            Shape::Ring { center, radius, .. } => {
                scale_all(center, self.length);
                grading(radius);
            }
            Shape::HalfDisc { center, radius, .. } | Shape::Disc { center, radius, .. } => {
                scale_all(center, self.length);
                *radius *= self.length;
            }
        }
    }

    fn scalar(&self, scalar: &mut Scalar, factor: f64) {
        match scalar {
            Scalar::Constant(value) => *value *= factor,
            Scalar::Expression(expression) => *expression = expression.rescaled(self.length, factor),
        }
    }

    fn region(&self, region: &mut Region) {
        match region {
            Region::Point(x) => scale_all(x, self.length),
            Region::Surface { within, .. } => self.within(within),
        }
    }

    pub fn within(&self, within: &mut Option<Box3>) {
        within.iter_mut().flatten().for_each(|corner| scale_all(corner, self.length));
    }
}

pub(super) fn scale_all(values: &mut [f64], factor: f64) {
    values.iter_mut().for_each(|value| *value *= factor);
}
