//! A case turned about the origin.
use crate::{
    case::{
        BodyCase, Geometry, InsertCells, Load, LoadKind, Origin, Region, RigidCase, RigidShape, Scalar,
        Temperature,
    },
    error::Result,
};

/// The sides of a box lie along x and y.
pub(super) const BOX: &str = "a case with a box 'within' cannot be rotated";

/// A rotation by `angle`, radians, counter-clockwise.
pub(super) struct Turn {
    angle: f64,
    sin: f64,
    cos: f64,
}

impl Turn {
    pub fn new(angle: f64) -> Self {
        let (sin, cos) = angle.sin_cos();
        Turn { angle, sin, cos }
    }

    pub fn vector(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        [self.cos * x - self.sin * y, self.sin * x + self.cos * y, z]
    }

    fn field(&self, scalar: &mut Scalar) {
        if let Scalar::Expression(expression) = scalar {
            *expression = expression.rotated(self.angle);
        }
    }

    pub fn body(&self, body: &mut BodyCase) -> Result<()> {
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
        for insert in &body.inserts {
            if let InsertCells::Within(_) = insert.cells {
                return Err(insert.origin.error(BOX));
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

    pub fn rigid(&self, rigid: &mut RigidCase) {
        rigid.motion = self.vector(rigid.motion);
        match &mut rigid.shape {
            RigidShape::Plane { through, normal } => {
                (*through, *normal) = (self.vector(*through), self.vector(*normal));
            }
            RigidShape::Circle { center, .. } => *center = self.vector(*center),
            RigidShape::Polyline { points } => points.iter_mut().for_each(|p| *p = self.vector(*p)),
        }
    }

    fn load(&self, Load { kind, origin, .. }: &mut Load) -> Result<()> {
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

    fn constants(&self, vector: &mut [Scalar; 3], origin: &Origin) -> Result<()> {
        let [Scalar::Constant(x), Scalar::Constant(y), Scalar::Constant(z)] = *vector else {
            return Err(origin.error("a vector of expressions cannot be rotated"));
        };
        *vector = self.vector([x, y, z]).map(Scalar::Constant);
        Ok(())
    }

    fn region(&self, region: &mut Region, origin: &Origin) -> Result<()> {
        match region {
            Region::Point(x) => *x = self.vector(*x),
            Region::Surface { within: None, .. } => {}
            Region::Surface { within: Some(_), .. } => {
                return Err(origin.error(BOX));
            }
        }
        Ok(())
    }
}
