//! The same case, turned or in other units: what comes out must not depend on it.
use super::{
    BodyCase, Case, Gap, Geometry, Grading, Load, LoadKind, Property, Region, Scalar, Shape, SurfaceName,
    Temperature, Units,
};
use crate::error::Result;

type Box3 = [[f64; 3]; 2];

impl Case {
    /// The case turned as a whole by `angle` (radians, counter-clockwise) about the origin: geometry,
    /// supports, loads, temperatures, probes. Refused with what cannot be turned: a mesh file, a box
    /// `within`, a vector of expressions.
    pub fn rotated(&self, angle: f64) -> Result<Case> {
        let turn = Turn::new(angle);
        let mut case = self.clone();
        for body in &mut case.bodies {
            turn.body(body)?;
        }
        for contact in &case.contacts {
            if contact.surfaces.iter().any(|surface| surface.within.is_some()) {
                return Err(contact.origin.error("a case with a box 'within' cannot be rotated"));
            }
        }
        for probe in &mut case.probes {
            probe.at = turn.vector(probe.at);
        }
        case.output.window = None;
        Ok(case)
    }

    /// The case in other units: every length is multiplied by `length`, every pressure by `pressure`, so that
    /// m and Pa become mm and MPa with 1e3 and 1e-6. Temperatures stay.
    pub fn rescaled(&self, length: f64, pressure: f64) -> Case {
        let scale = Scale { length, pressure };
        let mut case = self.clone();
        case.units = Units::Consistent;
        let (super::Analysis::PlaneStress { thickness } | super::Analysis::PlaneStrain { thickness }) =
            &mut case.analysis;
        *thickness *= length;
        for body in &mut case.bodies {
            scale.body(body);
        }
        for contact in &mut case.contacts {
            let (Gap::Value(gap) | Gap::Geometry { offset: gap }) = &mut contact.gap;
            *gap *= length;
            contact.search_distance = contact.search_distance.map(|distance| distance * length);
            for SurfaceName { within, .. } in &mut contact.surfaces {
                scale.within(within);
            }
        }
        for probe in &mut case.probes {
            scale_all(&mut probe.at, length);
        }
        case.output.window = case.output.window.map(|corners| corners.map(|p| p.map(|x| x * length)));
        case
    }
}

struct Turn {
    angle: f64,
    sin: f64,
    cos: f64,
}

impl Turn {
    fn new(angle: f64) -> Self {
        let (sin, cos) = angle.sin_cos();
        Turn { angle, sin, cos }
    }

    fn vector(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        [self.cos * x - self.sin * y, self.sin * x + self.cos * y, z]
    }

    fn field(&self, scalar: &mut Scalar) {
        if let Scalar::Expression(expression) = scalar {
            *expression = expression.rotated(self.angle);
        }
    }

    fn body(&self, body: &mut BodyCase) -> Result<()> {
        match &mut body.geometry {
            Geometry::Gmsh { origin, .. } => {
                return Err(origin.error("a case with a mesh file cannot be rotated"));
            }
            Geometry::Generated { rotate, translate, .. } => {
                *rotate += self.angle;
                let [x, y, _] = self.vector([translate[0], translate[1], 0.0]);
                *translate = [x, y];
            }
        }
        match &mut body.temperature {
            Some(Temperature::Field(scalar)) => self.field(scalar),
            Some(Temperature::Nodal { values, .. }) => {
                values.iter_mut().for_each(|(x, _)| *x = self.vector(*x))
            }
            None => {}
        }
        for support in &mut body.supports {
            self.region(&mut support.region, &support.origin)?;
            support.angle += self.angle;
            support.displacement.iter_mut().flatten().for_each(|scalar| self.field(scalar));
        }
        body.loads.iter_mut().try_for_each(|load| self.load(load))
    }

    fn load(&self, Load { kind, origin }: &mut Load) -> Result<()> {
        match kind {
            LoadKind::Pressure(region, pressure) => {
                self.field(pressure);
                self.region(region, origin)
            }
            LoadKind::Force(region, force) => {
                *force = self.vector(*force);
                self.region(region, origin)
            }
            LoadKind::Traction(region, vector) => {
                self.constants(vector, origin)?;
                self.region(region, origin)
            }
            LoadKind::BodyForce(vector) => self.constants(vector, origin),
        }
    }

    fn constants(&self, vector: &mut [Scalar; 3], origin: &super::Origin) -> Result<()> {
        let [Scalar::Constant(x), Scalar::Constant(y), Scalar::Constant(z)] = *vector else {
            return Err(origin.error("a vector of expressions cannot be rotated"));
        };
        *vector = self.vector([x, y, z]).map(Scalar::Constant);
        Ok(())
    }

    fn region(&self, region: &mut Region, origin: &super::Origin) -> Result<()> {
        match region {
            Region::Point(x) => *x = self.vector(*x),
            Region::Surface { within: None, .. } => {}
            Region::Surface { within: Some(_), .. } => {
                return Err(origin.error("a case with a box 'within' cannot be rotated"));
            }
        }
        Ok(())
    }
}

struct Scale {
    length: f64,
    pressure: f64,
}

impl Scale {
    fn body(&self, body: &mut BodyCase) {
        match &mut body.geometry {
            Geometry::Gmsh { scale, .. } => *scale *= self.length,
            Geometry::Generated { shape, translate, .. } => {
                self.shape(shape);
                scale_all(translate, self.length);
            }
        }
        match &mut body.material.young {
            Property::Constant(value) => *value *= self.pressure,
            Property::Table(rows) => rows.iter_mut().for_each(|row| row.1 *= self.pressure),
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

    fn within(&self, within: &mut Option<Box3>) {
        within.iter_mut().flatten().for_each(|corner| scale_all(corner, self.length));
    }
}

fn scale_all(values: &mut [f64], factor: f64) {
    values.iter_mut().for_each(|value| *value *= factor);
}
