//! City models in CityJSON: walls and roofs as polygons.
//!
//! Source: CityJSON 1.0.1, 1.1.3 and 2.0.1 (OGC 20-072). Read are `transform`, `vertices`, the reference
//! system, and of each building or bridge the geometry of the wanted or the highest level of detail as
//! `MultiSurface`, `CompositeSurface`, `Solid`, `MultiSolid` or `CompositeSolid`, with the kind of each
//! surface. Limits: textures, attributes and templates are passed over, and so are surfaces inside of
//! buildings, objects that are no construction (terrain, vegetation, water, streets) and what has level 0,
//! which is a footprint. Lines of `CityJSONSeq` are not read.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::Value;
use thiserror::Error;

/// Reason for which a text is no city model that can be used.
#[derive(Debug, Error)]
pub enum CityError {
    /// Text that is not JSON, or whose objects are not those of CityJSON.
    #[error("{name}:{line}:{column}: not CityJSON: {what}")]
    Syntax {
        /// Name of the file.
        name: String,
        /// Line of the fault, from 1.
        line: usize,
        /// Column of the fault, from 1.
        column: usize,
        /// Message of the parser.
        what: String,
    },
    /// A value that cannot be used.
    #[error("{name}: {path} = {value}: expected {expected}")]
    Value {
        /// Name of the file.
        name: String,
        /// Keys and positions that lead to the value.
        path: String,
        /// The value as written.
        value: String,
        /// Values that are expected.
        expected: String,
    },
}

/// Kind of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// `WallSurface`.
    Wall,
    /// `RoofSurface`.
    Roof,
    /// `GroundSurface`.
    Ground,
    /// A surface of another kind, or of none.
    Other,
}

/// Plane polygon.
#[derive(Clone, Debug, PartialEq, Hash)]
pub struct Surface {
    /// Number of its object in [`Model::objects`].
    pub object: usize,
    /// Kind of the surface.
    pub kind: Kind,
    /// Numbers of vertices: the outer ring, counter-clockwise as seen from outside, then holes. Each ring has
    /// three numbers at least.
    pub rings: Vec<Vec<u32>>,
}

/// Walls and roofs of a city.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Name of the reference system of the vertices, if there is one.
    pub reference: Option<String>,
    /// Coordinates of the vertices: east, north and height in metres of the reference system.
    pub vertices_m: Vec<[f64; 3]>,
    /// Surfaces, by the order of the objects' names.
    pub surfaces: Vec<Surface>,
    /// Names of the objects that have surfaces.
    pub objects: Vec<String>,
    /// Number of objects without a surface that is read.
    pub left_out: usize,
    /// Number of surfaces and holes left out because they have fewer than three corners.
    pub degenerate: usize,
}

/// Coordinates that no reference system reaches, in metres.
const FARTHEST_M: f64 = 1e9;
/// Kinds of objects that are read.
const CONSTRUCTIONS: [&str; 9] = [
    "Building",
    "BuildingPart",
    "BuildingInstallation",
    "BuildingConstructiveElement",
    "Bridge",
    "BridgePart",
    "BridgeInstallation",
    "BridgeConstructiveElement",
    "OtherConstruction",
];

#[derive(Deserialize)]
struct Document {
    #[serde(rename = "type")]
    kind: String,
    version: String,
    transform: Option<Transform>,
    metadata: Option<Metadata>,
    #[serde(rename = "CityObjects")]
    objects: BTreeMap<String, Object>,
    vertices: Vec<[f64; 3]>,
}

#[derive(Deserialize)]
struct Transform {
    scale: [f64; 3],
    translate: [f64; 3],
}

#[derive(Deserialize)]
struct Metadata {
    #[serde(rename = "referenceSystem")]
    reference: Option<String>,
}

#[derive(Deserialize)]
struct Object {
    #[serde(rename = "type")]
    kind: String,
    geometry: Option<Vec<Geometry>>,
}

#[derive(Deserialize)]
struct Geometry {
    #[serde(rename = "type")]
    kind: String,
    lod: Option<Value>,
    boundaries: Option<Value>,
    semantics: Option<Semantics>,
}

#[derive(Deserialize)]
struct Semantics {
    surfaces: Vec<Named>,
    values: Option<Value>,
}

#[derive(Deserialize)]
struct Named {
    #[serde(rename = "type")]
    kind: String,
}

impl Geometry {
    /// Arrays around each surface in `boundaries`; `None` of a geometry without surfaces.
    fn depth(&self) -> Option<usize> {
        match self.kind.as_str() {
            "MultiSurface" | "CompositeSurface" => Some(1),
            "Solid" => Some(2),
            "MultiSolid" | "CompositeSolid" => Some(3),
            _ => None,
        }
    }

    /// Level of detail as text: a number in version 1.0, a text since then.
    fn level(&self) -> String {
        match &self.lod {
            Some(Value::String(text)) => text.clone(),
            Some(Value::Number(number)) => number.to_string(),
            _ => String::new(),
        }
    }

    /// True if the geometry has surfaces of the wanted level: `2` wants 2, 2.0 to 2.3; `2.2` itself alone.
    fn is_of(&self, lod: Option<&str>) -> bool {
        let level = self.level();
        let wanted =
            lod.is_none_or(|lod| level == lod || level.strip_prefix(lod).is_some_and(|rest| rest.starts_with('.')));
        self.depth().is_some() && !level.starts_with('0') && wanted
    }
}

/// Reads a city model; `name` names the file in errors. `lod` chooses the level of detail; absent means the
/// highest of each object.
///
/// # Errors
/// [`CityError`] with the position of what cannot be used.
pub fn read(bytes: &[u8], name: &str, lod: Option<&str>) -> Result<Model, CityError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let document: Document = serde_json::from_slice(bytes).map_err(|error| CityError::Syntax {
        name: name.to_owned(),
        line: error.line(),
        column: error.column(),
        what: bare(&error),
    })?;
    let refuse = |path: String, value: String, expected: &str| {
        Err(CityError::Value { name: name.to_owned(), path, value, expected: expected.to_owned() })
    };
    if document.kind != "CityJSON" {
        return refuse("type".to_owned(), format!("{:?}", document.kind), "\"CityJSON\"");
    }
    if !["1.0", "1.1", "2.0"].iter().any(|known| document.version.starts_with(known)) {
        return refuse("version".to_owned(), format!("{:?}", document.version), "\"1.0\", \"1.1\" or \"2.0\"");
    }
    if document.transform.is_none() && !document.version.starts_with("1.0") {
        return refuse(
            "transform".to_owned(),
            "(absent)".to_owned(),
            "scale and translate, because version 1.1 and 2.0 need it",
        );
    }
    let (scale, translate) = document.transform.map_or(([1.0; 3], [0.0; 3]), |t| (t.scale, t.translate));
    if let Some(axis) = scale.iter().position(|scale| *scale <= 0.0) {
        return refuse(format!("transform.scale[{axis}]"), scale[axis].to_string(), "a number above 0");
    }
    let mut vertices_m = document.vertices;
    for (number, vertex) in vertices_m.iter_mut().enumerate() {
        for ((x, scale), translate) in vertex.iter_mut().zip(scale).zip(translate) {
            *x = *x * scale + translate;
        }
        if vertex.iter().any(|x| x.is_nan() || x.abs() > FARTHEST_M) {
            return refuse(format!("vertices[{number}]"), format!("{vertex:?} m"), "coordinates within 1e9 m");
        }
    }
    let reference = document.metadata.and_then(|metadata| metadata.reference);
    let mut model =
        Model { reference, vertices_m, surfaces: Vec::new(), objects: Vec::new(), left_out: 0, degenerate: 0 };
    for (id, object) in &document.objects {
        let before = model.surfaces.len();
        if CONSTRUCTIONS.contains(&object.kind.as_str()) {
            let all = object.geometry.iter().flatten().enumerate().filter(|(_, geometry)| geometry.is_of(lod));
            // Of equal levels the first.
            let best = all.reduce(|best, other| if other.1.level() > best.1.level() { other } else { best });
            if let Some((number, geometry)) = best {
                let path = format!("CityObjects[{id:?}].geometry[{number}]");
                Reader { name, geometry, model: &mut model }.whole(&path)?;
            }
        }
        if model.surfaces.len() > before {
            model.objects.push(id.clone());
        } else {
            model.left_out += 1;
        }
    }
    if model.surfaces.is_empty() {
        let expected = match lod {
            Some(lod) => format!("a building or bridge with surfaces of level of detail {lod}"),
            None => "a building or bridge with surfaces of level of detail 1 or more".to_owned(),
        };
        return refuse("CityObjects".to_owned(), format!("{} objects", document.objects.len()), &expected);
    }
    Ok(model)
}

/// Message of the parser without its position, which stands in front.
fn bare(error: &serde_json::Error) -> String {
    let text = error.to_string();
    text.rsplit_once(" at line ").map_or(text.clone(), |(what, _)| what.to_owned())
}

struct Reader<'a> {
    name: &'a str,
    geometry: &'a Geometry,
    model: &'a mut Model,
}

impl Reader<'_> {
    fn refuse<T>(&self, path: &str, value: &Value, expected: impl Into<String>) -> Result<T, CityError> {
        let mut text = value.to_string();
        if let Some((end, _)) = text.char_indices().nth(60) {
            text.truncate(end);
            text += "…";
        }
        Err(CityError::Value {
            name: self.name.to_owned(),
            path: path.to_owned(),
            value: text,
            expected: expected.into(),
        })
    }

    fn whole(&mut self, path: &str) -> Result<(), CityError> {
        let (geometry, path) = (self.geometry, format!("{path}.boundaries"));
        let Some(boundaries) = &geometry.boundaries else {
            return self.refuse(&path, &Value::Null, "arrays of rings of vertices");
        };
        let kinds = geometry.semantics.as_ref().and_then(|semantics| semantics.values.as_ref());
        self.level(boundaries, kinds, geometry.depth().unwrap_or(1), path)
    }

    /// Reads arrays until `depth` is 0, where a surface is.
    fn level(&mut self, value: &Value, kinds: Option<&Value>, depth: usize, path: String) -> Result<(), CityError> {
        if depth == 0 {
            return self.surface(value, kinds, &path);
        }
        let Value::Array(items) = value else { return self.refuse(&path, value, "an array") };
        for (number, item) in items.iter().enumerate() {
            // A level of kinds may be null as a whole.
            let of_it = match kinds {
                Some(Value::Array(all)) => all.get(number),
                _ => None,
            };
            self.level(item, of_it, depth - 1, format!("{path}[{number}]"))?;
        }
        Ok(())
    }

    fn surface(&mut self, value: &Value, kind: Option<&Value>, path: &str) -> Result<(), CityError> {
        let Some(kind) = self.kind(kind, path)? else { return Ok(()) };
        let Value::Array(items) = value else { return self.refuse(path, value, "an array of rings") };
        let mut rings = Vec::with_capacity(items.len());
        for (number, item) in items.iter().enumerate() {
            let ring = self.ring(item, &format!("{path}[{number}]"))?;
            if ring.len() >= 3 {
                rings.push(ring);
                continue;
            }
            self.model.degenerate += 1;
            if number == 0 {
                return Ok(());
            }
        }
        if rings.is_empty() {
            self.model.degenerate += 1;
        } else {
            self.model.surfaces.push(Surface { object: self.model.objects.len(), kind, rings });
        }
        Ok(())
    }

    /// Kind of a surface by its number among the semantics; `None` of one that is inside or is none.
    fn kind(&self, number: Option<&Value>, path: &str) -> Result<Option<Kind>, CityError> {
        let (Some(number), Some(semantics)) = (number.filter(|number| !number.is_null()), &self.geometry.semantics)
        else {
            return Ok(Some(Kind::Other));
        };
        let named = number.as_u64().and_then(|number| semantics.surfaces.get(usize::try_from(number).ok()?));
        let Some(named) = named else {
            let path = path.replacen(".boundaries", ".semantics.values", 1);
            return self.refuse(&path, number, format!("null or a number below {}", semantics.surfaces.len()));
        };
        Ok(match named.kind.as_str() {
            "WallSurface" => Some(Kind::Wall),
            "RoofSurface" => Some(Kind::Roof),
            "GroundSurface" => Some(Kind::Ground),
            "ClosureSurface" | "InteriorWallSurface" | "CeilingSurface" | "FloorSurface" => None,
            _ => Some(Kind::Other),
        })
    }

    /// Numbers of a ring's vertices, without repetitions of neighbours.
    fn ring(&self, value: &Value, path: &str) -> Result<Vec<u32>, CityError> {
        let Value::Array(items) = value else { return self.refuse(path, value, "an array of numbers of vertices") };
        let mut ring: Vec<u32> = Vec::with_capacity(items.len());
        for (number, item) in items.iter().enumerate() {
            let vertex = item.as_u64().and_then(|vertex| u32::try_from(vertex).ok());
            let Some(vertex) = vertex.filter(|vertex| (*vertex as usize) < self.model.vertices_m.len()) else {
                let expected = format!("the number of a vertex, below {}", self.model.vertices_m.len());
                return self.refuse(&format!("{path}[{number}]"), item, expected);
            };
            if ring.last() != Some(&vertex) {
                ring.push(vertex);
            }
        }
        while ring.len() > 1 && ring.first() == ring.last() {
            ring.pop();
        }
        Ok(ring)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A house whose levels, geometry and metadata are put in.
    fn house(version: &str, extra: &str, geometry: &str) -> String {
        format!(
            "{{\"type\":\"CityJSON\",\"version\":\"{version}\",{extra}\n\"CityObjects\":{{\"a\":{{\
             \"type\":\"Building\",\"geometry\":[{geometry}]}},\"t\":{{\
             \"type\":\"TINRelief\",\"geometry\":[]}}}},\n\"vertices\":\
             [[0,0,0],[1000,0,0],[1000,2000,0],[0,2000,0],[0,0,3000],[1000,0,3000]]}}"
        )
    }

    const TRANSFORM: &str = "\"transform\":{\"scale\":[0.001,0.001,0.001],\"translate\":[85000,447500,-1]},";
    const WALLS: &str = "{\"type\":\"MultiSurface\",\"lod\":\"2\",\"boundaries\":[[[0,1,5,4]],[[0,3,2,1]]],\
                         \"semantics\":{\"surfaces\":[{\"type\":\"WallSurface\"},\
                         {\"type\":\"GroundSurface\"}],\"values\":[0,1]}}";

    #[test]
    fn vertices_are_scaled_and_moved_and_surfaces_have_their_kinds() {
        let text = house("1.1", TRANSFORM, WALLS);
        let model = read(text.as_bytes(), "a.json", None).unwrap();
        assert_eq!(model.vertices_m[5], [85_001.0, 447_500.0, 2.0]);
        assert_eq!(model.surfaces.len(), 2);
        assert_eq!(
            (model.surfaces[0].kind, model.surfaces[0].rings.as_slice()),
            (Kind::Wall, [vec![0, 1, 5, 4]].as_slice())
        );
        assert_eq!(model.surfaces[1].kind, Kind::Ground);
        assert_eq!((model.objects.as_slice(), model.left_out), (["a".to_owned()].as_slice(), 1));
        // Version 1.0 may have no transform, and numbers as levels.
        let text = house("1.0", "", &WALLS.replace("\"2\"", "2"));
        assert_eq!(read(text.as_bytes(), "a.json", Some("2")).unwrap().vertices_m[5], [1000.0, 0.0, 3000.0]);
    }

    #[test]
    fn solids_are_read_through_their_shells_and_a_wall_may_have_no_kind() {
        let solid = "{\"type\":\"Solid\",\"lod\":\"1.2\",\"boundaries\":[[[[0,1,5,4]],[[0,3,2,1]]]],\"semantics\":\
                     {\"surfaces\":[{\"type\":\"RoofSurface\"}],\"values\":[[null,0]]}}";
        let model = read(house("2.0", TRANSFORM, solid).as_bytes(), "a.json", None).unwrap();
        let kinds: Vec<Kind> = model.surfaces.iter().map(|surface| surface.kind).collect();
        assert_eq!(kinds, [Kind::Other, Kind::Roof]);
        let several =
            format!("{{\"type\":\"MultiSolid\",\"lod\":\"1\",\"boundaries\":[{}]}}", "[[[[0,1,5,4]]]],[[[[0,3,2,1]]]]");
        assert_eq!(read(house("2.0", TRANSFORM, &several).as_bytes(), "a.json", None).unwrap().surfaces.len(), 2);
    }

    #[test]
    fn the_highest_level_is_taken_unless_one_is_wanted() {
        let low = "{\"type\":\"MultiSurface\",\"lod\":\"1.2\",\"boundaries\":[[[0,1,5]]]}";
        let print = "{\"type\":\"MultiSurface\",\"lod\":\"0\",\"boundaries\":[[[0,1,2,3]]]}";
        let text = house("2.0", TRANSFORM, &format!("{print},{low},{WALLS}"));
        let surfaces = |lod| read(text.as_bytes(), "a.json", lod).map(|model| model.surfaces.len());
        assert_eq!(surfaces(None).unwrap(), 2);
        assert_eq!(surfaces(Some("1")).unwrap(), 1);
        assert_eq!(surfaces(Some("1.2")).unwrap(), 1);
        let error = surfaces(Some("3")).unwrap_err().to_string();
        assert_eq!(
            error,
            "a.json: CityObjects = 2 objects: expected a building or bridge with surfaces of level of detail 3"
        );
        assert!(surfaces(Some("0")).is_err());
    }

    #[test]
    fn what_cannot_be_used_is_refused_at_its_position() {
        let cases = [
            (
                house("1.1", TRANSFORM, &WALLS.replace("5,4", "9,4")),
                "a.json: CityObjects[\"a\"].geometry[0].boundaries[0][0][2] = 9: expected the number of a vertex",
            ),
            (house("1.1", TRANSFORM, &WALLS.replace("5,4", "-1,4")), "boundaries[0][0][2] = -1: expected"),
            (
                house("1.1", TRANSFORM, &WALLS.replace("[0,1]", "[0,2]")),
                "geometry[0].semantics.values[1] = 2: expected null or a number below 2",
            ),
            (
                house("1.1", TRANSFORM, &WALLS.replace("[[[0,1,5,4]],[[0,3,2,1]]]", "[[0,1,5,4]]")),
                "boundaries[0][0] = 0: expected an array of numbers",
            ),
            (
                house("1.1", TRANSFORM, &WALLS.replace("\"boundaries\":[[[0,1,5,4]],[[0,3,2,1]]],", "")),
                "boundaries = null: expected",
            ),
            (house("1.1", "", WALLS), "a.json: transform = (absent): expected"),
            (
                house("1.1", &TRANSFORM.replace("[0.001,", "[0,"), WALLS),
                "a.json: transform.scale[0] = 0: expected a number above 0",
            ),
            (house("1.1", &TRANSFORM.replace("85000", "1e10"), WALLS), "a.json: vertices[0] = [10000000000.0"),
            (house("0.9", TRANSFORM, WALLS), "a.json: version = \"0.9\": expected"),
            (
                house("1.1", TRANSFORM, WALLS).replace("\"CityJSON\"", "\"CityJSONFeature\""),
                "a.json: type = \"CityJSONFeature\"",
            ),
            (house("1.1", TRANSFORM, WALLS).replace("[1000,0,0]", "[1000,0]"), "a.json:3:"),
            (
                house("1.1", TRANSFORM, WALLS).replace("\"vertices\"", "\"vertex\""),
                "not CityJSON: missing field `vertices`",
            ),
            ("{".to_owned(), "a.json:1:1: not CityJSON: EOF while parsing an object"),
            (String::new(), "a.json:1:0: not CityJSON"),
        ];
        for (text, expected) in cases {
            let error = read(text.as_bytes(), "a.json", None).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}\n{expected}");
            assert!(error.starts_with("a.json:"), "{error}");
        }
    }

    #[test]
    fn surfaces_without_area_and_inner_ones_are_left_out() {
        let text = house("1.1", TRANSFORM, &WALLS.replace("[[[0,1,5,4]],", "[[[0,1,1,0]],"));
        let model = read(text.as_bytes(), "a.json", None).unwrap();
        assert_eq!((model.surfaces.len(), model.degenerate), (1, 1));
        let text = house("1.1", TRANSFORM, &WALLS.replace("WallSurface", "ClosureSurface"));
        assert_eq!(read(text.as_bytes(), "a.json", None).unwrap().surfaces.len(), 1);
    }
}
