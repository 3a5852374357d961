//! Table `[array]`: several antennas on one body, each with a front end of its own.
//!
//! A scene with an array is one with several front ends that sample alike: the scene's one `[front_end]`
//! stands for each. The first element is the one whose position and signals the truth states. Limits: sixteen
//! elements; one antenna pattern for all; nothing whose waves come from more directions than the geometry
//! has (echoes), no pushed motion and no modelled correlations.

use std::sync::Arc;

use nalgebra::Vector3;
use num_complex::Complex64;

use super::front_end::FrontEnd;
use super::keys::array::NAME;
use super::read::{Refusals, Table};
use super::{Scenario, ScenarioError};
use crate::array::Element;
use crate::scene::{Grade, Scene};
use crate::vehicle::Trajectory;
use crate::vehicle::attitude::Nose;

/// Elements of one array at most.
const MOST: usize = 16;
/// Tables beside which there is no array, and the reason.
const BESIDE: [(&str, &str); 3] = [
    ("multipath", "echoes have no direction"),
    ("city", "echoes are made for one antenna"),
    ("playback", "the transmitter plays the samples of one receiver"),
];

/// Element as written.
#[derive(Clone, Debug, PartialEq)]
pub struct ElementSpec {
    /// Name of its files.
    pub name: String,
    /// Position in body axes from the antenna of the attitude, in metres.
    pub lever_arm_m: Vector3<f64>,
    /// Error of the gain as a factor on amplitudes.
    pub gain: f64,
    /// Phase by which it is ahead, in cycles.
    pub phase_cycles: f64,
    /// Delay in seconds.
    pub delay_s: f64,
    /// Row of the coupling matrix; empty without one.
    pub coupling: Vec<Complex64>,
}

/// Reads `[array]`, `None` without one, and gives each element a front end like the scene's one.
pub(super) fn array(
    root: &Table<'_>,
    front_ends: Option<Vec<FrontEnd>>,
    refusals: &mut Refusals,
) -> (Option<Vec<ElementSpec>>, Option<Vec<FrontEnd>>) {
    let elements = elements(root, refusals);
    let front_ends = front_ends.map(|all| match &elements {
        Some(elements) => of_elements(root, elements, all, refusals),
        None => all,
    });
    (elements, front_ends)
}

fn elements(root: &Table<'_>, refusals: &mut Refusals) -> Option<Vec<ElementSpec>> {
    let table = refusals.take(root.table("array")).flatten()?;
    for (name, reason) in BESIDE.into_iter().filter(|(name, _)| root.has(name)) {
        refusals.add(root.bad(name, format!("nothing beside [array]: {reason}")));
    }
    if !root.has("attitude") {
        refusals.add(root.bad("attitude", "[attitude] beside [array]: lever arms of elements are in the body's axes"));
    }
    let tables = refusals.take(table.tables("element")).flatten().unwrap_or_default();
    if tables.is_empty() || tables.len() > MOST {
        refusals.add(table.bad("element", format!("1 to {MOST} elements, not {}", tables.len())));
    }
    let mut elements: Vec<ElementSpec> = Vec::with_capacity(tables.len());
    for (number, element) in (1..).zip(&tables) {
        elements.extend(refusals.take(read(element, number, &elements)));
    }
    let matrix = refusals.take(coupling(&table, tables.len())).flatten().unwrap_or_default();
    for (element, row) in elements.iter_mut().zip(matrix) {
        element.coupling = row;
    }
    Some(elements)
}

fn read(table: &Table<'_>, number: usize, before: &[ElementSpec]) -> Result<ElementSpec, ScenarioError> {
    let usual = format!("e{number}");
    let name = table.text("name")?.unwrap_or(&usual);
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if name.is_empty() || name.len() > 64 || !name.chars().all(fits) {
        return Err(table.bad("name", NAME));
    }
    if before.iter().any(|other| other.name.eq_ignore_ascii_case(name)) {
        return Err(table.bad("name", "a name that no other element has, capitals apart"));
    }
    Ok(ElementSpec {
        name: name.to_owned(),
        lever_arm_m: Vector3::from(table.numbers::<3>("lever_arm_m")?.unwrap_or_default()),
        gain: libm::pow(10.0, table.need("gain_db")? / 20.0),
        phase_cycles: table.need("phase_deg")? / 360.0,
        delay_s: table.need("delay_ns")? * 1e-9,
        coupling: Vec::new(),
    })
}

/// Rows of the coupling matrix; `None` without one.
fn coupling(table: &Table<'_>, count: usize) -> Result<Option<Vec<Vec<Complex64>>>, ScenarioError> {
    let (sizes, phases) = match (table.list("coupling_db")?, table.list("coupling_deg")?) {
        (None, None) => return Ok(None),
        (Some(sizes), Some(phases)) => (sizes, phases),
        (Some(_), None) => return Err(table.bad("coupling_deg", "phases, because coupling_db is given")),
        (None, Some(_)) => return Err(table.bad("coupling_db", "sizes, because coupling_deg is given")),
    };
    for (key, list) in [("coupling_db", &sizes), ("coupling_deg", &phases)] {
        if list.len() != count * count {
            let expected = format!("{} numbers, a row of {count} for each of {count} elements", count * count);
            return Err(table.bad(key, expected));
        }
    }
    let factor = |(db, deg): (&f64, &f64)| {
        let (sin, cos) = libm::sincos(deg.to_radians());
        Complex64::new(cos, sin) * libm::pow(10.0, db / 20.0)
    };
    let factors: Vec<Complex64> = sizes.iter().zip(&phases).map(factor).collect();
    let rows: Vec<Vec<Complex64>> = factors.chunks(count.max(1)).map(<[Complex64]>::to_vec).collect();
    for (k, row) in rows.iter().enumerate() {
        let whole: f64 = row.iter().map(|factor| factor.norm_sqr().sqrt()).sum();
        let own = row.get(k).map_or(0.0, |factor| factor.norm_sqr().sqrt());
        if whole >= 2.0 * own {
            let expected = format!("row {} with less beside its diagonal, amplitudes added, than on it", k + 1);
            return Err(table.bad("coupling_db", expected));
        }
    }
    Ok(Some(rows))
}

/// Front ends of the elements: the scene's only one, as often as there are elements.
fn of_elements(
    root: &Table<'_>,
    elements: &[ElementSpec],
    front_ends: Vec<FrontEnd>,
    refusals: &mut Refusals,
) -> Vec<FrontEnd> {
    match front_ends.as_slice() {
        [one] if one.name.is_none() => {
            let of = |(number, element): (usize, &ElementSpec)| FrontEnd {
                name: Some(element.name.clone()),
                element: Some(number),
                ..one.clone()
            };
            elements.iter().enumerate().map(of).collect()
        }
        [_] => {
            refusals.add(root.bad("front_end", "no name beside [array], whose elements have names"));
            front_ends
        }
        _ => {
            refusals.add(root.bad("front_end", "one [front_end] beside [array]: it stands for that of each element"));
            front_ends
        }
    }
}

impl Scenario {
    /// Element of a front end, where there is an array.
    pub(super) fn element_of(&self, front_end: &FrontEnd) -> Option<&ElementSpec> {
        self.array.as_ref()?.get(front_end.element?)
    }

    /// Motion of the antenna of element `number`, on a body whose antenna moves along `body`.
    pub(super) fn element_motion(&self, body: &Trajectory, number: usize) -> Trajectory {
        let element = self.array.as_ref().and_then(|elements| elements.get(number));
        match (element, body.attitude()) {
            (Some(element), Some(attitude)) => {
                let mut attitude = *attitude;
                attitude.lever_arm_m += element.lever_arm_m;
                body.clone().with_attitude(attitude)
            }
            _ => body.clone(),
        }
    }

    /// Refuses what an array cannot have beside it.
    pub(super) fn suits_array(&self) -> Result<(), ScenarioError> {
        if self.array.is_none() {
            return Ok(());
        }
        if self.attitude.is_some_and(|attitude| matches!(attitude.nose, Nose::Pushed { .. })) {
            let reason = "kind = \"pushed\" beside [array]: expected fixed or velocity";
            return Err(self.conflict("attitude", reason.to_owned()));
        }
        let spec = self.front_ends.iter().find(|one| one.fidelity.grade == Grade::Correlations);
        spec.map_or(Ok(()), |_| {
            let reason = "correlations beside [array]: its spatial filter needs samples; expected another level";
            Err(self.conflict("fidelity.level", reason.to_owned()))
        })
    }

    /// Makes a scene that of its element, on a body whose antenna moves along `body`: its position, what its
    /// channel does to satellites and emitters, and its gain.
    pub(super) fn at_element(&self, scene: &mut Scene, front_end: &FrontEnd, body: &Trajectory) {
        let (Some(number), Some(spec), Some(all)) = (front_end.element, self.element_of(front_end), &self.array) else {
            return;
        };
        scene.trajectory = self.element_motion(body, number);
        scene.noise_lsb *= spec.gain as f32;
        let element = Arc::new(Element {
            number,
            start: self.start,
            body: body.clone(),
            lever_arms_m: all.iter().map(|element| element.lever_arm_m).collect(),
            coupling: spec.coupling.clone(),
            gain: spec.gain,
            phase_cycles: spec.phase_cycles,
            delay_s: spec.delay_s,
        });
        let tuning = scene.tuning();
        for source in &mut scene.interference {
            let antenna = scene.trajectory.clone();
            source.at_element(antenna, tuning.clone(), (!element.is_ideal()).then(|| Arc::clone(&element)));
        }
        if !element.is_ideal() {
            scene.effects.push(Box::new(Arc::clone(&element)));
        }
        scene.element = Some(element);
    }
}
