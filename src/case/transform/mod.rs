//! The same case turned, moved, with its sides exchanged, or in other units: what comes out must not depend on it.
mod box3;
mod scale;
mod shift;
mod turn;

use super::{Analysis, BodyRef, Case, Gap, SurfaceName, Units};
use crate::{contact::Law, error::Result};
use scale::{Scale, scale_all};
use shift::Shift;
use turn::Turn;

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
        case.rigid.iter_mut().for_each(|rigid| turn.rigid(rigid));
        for contact in &case.contacts {
            if contact.surfaces.iter().any(|surface| surface.within.is_some()) {
                return Err(contact.origin.error(turn::BOX));
            }
        }
        for probe in &mut case.probes {
            probe.at = turn.vector(probe.at);
        }
        case.output.window = None;
        Ok(case)
    }

    /// The case moved as a whole by (`dx`, `dy`), m: geometry, boxes, points, temperatures, expressions, probes,
    /// rigid bodies, output window. Refused with a mesh file, which cannot be moved.
    pub fn translated(&self, dx: f64, dy: f64) -> Result<Case> {
        let shift = Shift([dx, dy, 0.0]);
        let mut case = self.clone();
        case.bodies.iter_mut().try_for_each(|body| shift.body(body))?;
        case.rigid.iter_mut().for_each(|rigid| shift.rigid(rigid));
        for SurfaceName { within, .. } in case.contacts.iter_mut().flat_map(|c| &mut c.surfaces) {
            shift.within(within);
        }
        case.probes.iter_mut().for_each(|probe| shift.point(&mut probe.at));
        case.output.window.iter_mut().flatten().for_each(|corner| shift.point(corner));
        Ok(case)
    }

    /// The case with the two surfaces of every pair exchanged, and the bodies in reverse order. Names stay.
    pub fn swapped(&self) -> Case {
        let mut case = self.clone();
        case.bodies.reverse();
        case.rigid.reverse();
        let (n_bodies, n_rigid) = (case.bodies.len(), case.rigid.len());
        for contact in &mut case.contacts {
            contact.surfaces.reverse();
            for SurfaceName { body, .. } in &mut contact.surfaces {
                *body = match *body {
                    BodyRef::Deformable(i) => BodyRef::Deformable(n_bodies - 1 - i),
                    BodyRef::Rigid(i) => BodyRef::Rigid(n_rigid - 1 - i),
                };
            }
        }
        for probe in &mut case.probes {
            probe.body = n_bodies - 1 - probe.body;
        }
        case
    }

    /// The case in other units: every length is multiplied by `length`, every pressure by `pressure`, so that
    /// m and Pa become mm and MPa with 1e3 and 1e-6. Temperatures stay.
    pub fn rescaled(&self, length: f64, pressure: f64) -> Case {
        let scale = Scale { length, pressure };
        let mut case = self.clone();
        case.units = Units::Consistent;
        let (Analysis::PlaneStress { thickness } | Analysis::PlaneStrain { thickness }) = &mut case.analysis;
        *thickness *= length;
        for body in &mut case.bodies {
            scale.body(body);
        }
        case.rigid.iter_mut().for_each(|rigid| scale.rigid(rigid));
        for contact in &mut case.contacts {
            let (Gap::Value(gap) | Gap::Geometry { offset: gap }) = &mut contact.gap;
            *gap *= length;
            contact.search_distance = contact.search_distance.map(|distance| distance * length);
            if let Law::Tresca { shear } = &mut contact.law {
                *shear *= pressure;
                contact.over_temperature.iter_mut().for_each(|property| scale.property(property));
            }
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
