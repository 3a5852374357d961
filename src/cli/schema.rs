//! `schema`: JSON schemas (draft 7) of the program's files, from the declarations that its readers use.
//!
//! Editors take them from a file's first line, `#:schema PATH`. What a schema cannot say is left to the
//! program: which keys exclude each other, what a scene as a whole is capable of.

use std::collections::BTreeMap;

use serde_json::{Map, Value as Json, json};

use crate::cli::args::{self, SchemaOf};
use crate::cli::error::CliError;
use crate::cli::scenario as files;
use analysis::judge::schema::leaves;
use generator::scenario::keys::SCENARIO;
use generator::scenario::schema::{Absent, Key, Value};
use receiver::settings::reference as receiver;
use study::sweep::keys::STUDY;

/// Prints one of them.
pub fn execute(arguments: &args::Schema) -> Result<(), CliError> {
    files::print(&match arguments.of {
        SchemaOf::Scenario => scenario(),
        SchemaOf::Receiver => document("Settings of gnss-twin receive", settings()),
        SchemaOf::Study => document("Study of gnss-twin", object(STUDY)),
        SchemaOf::Limits => document("Limits of gnss-twin --check", limits()),
    })
}

/// The schema of a scene.
pub fn scenario() -> String {
    let mut scene = object(SCENARIO);
    // Stations may have their own.
    if let Some(required) = scene["required"].as_array_mut() {
        required.retain(|name| name != "motion");
    }
    scene["anyOf"] = json!([{ "required": ["motion"] }, { "required": ["station"] }]);
    document("Scene of gnss-twin", scene)
}

fn document(title: &str, mut schema: Json) -> String {
    if let Some(fields) = schema.as_object_mut() {
        fields.shift_insert(0, "$schema".to_owned(), json!("http://json-schema.org/draft-07/schema#"));
        fields.shift_insert(1, "title".to_owned(), json!(title));
    }
    format!("{schema:#}\n")
}

/// A table of keys. Where one key names the table's kind, keys of other kinds are refused beside it.
fn object(keys: &'static [Key]) -> Json {
    let mut by_name: BTreeMap<&str, Vec<&'static Key>> = BTreeMap::new();
    keys.iter().for_each(|key| by_name.entry(key.name).or_default().push(key));
    let property = |(name, keys): (&&str, &Vec<&'static Key>)| match keys.as_slice() {
        [key] => ((*name).to_owned(), of_key(key)),
        // Which of them counts follows from the table's kind.
        _ => ((*name).to_owned(), json!({})),
    };
    let properties: Map<String, Json> = by_name.iter().map(property).collect();
    let required = |kind: Option<&str>| -> Vec<&str> {
        let wanted = |key: &&Key| match kind {
            None => key.kinds.is_empty(),
            Some(kind) => key.is_of(kind),
        };
        let required = keys.iter().filter(|key| matches!(key.absent, Absent::Required));
        required.filter(wanted).map(|key| key.name).collect()
    };
    let mut schema = json!({
        "type": "object", "properties": properties, "required": required(None), "additionalProperties": false,
    });
    let kinds = keys.iter().find_map(|key| match key.value {
        Value::Word(words) if keys.iter().any(|other| belongs(other, &words())) => Some((key.name, words())),
        _ => None,
    });
    if let Some((name, words)) = kinds {
        let of_kind = |word: &&str| {
            let known = keys.iter().filter(|key| key.is_of(word));
            // What keys of one name mean in this kind.
            let shared = known.clone().filter(|key| by_name.get(key.name).is_some_and(|keys| keys.len() > 1));
            let properties: Map<String, Json> = shared.map(|key| (key.name.to_owned(), of_key(key))).collect();
            let names: Vec<&str> = known.map(|key| key.name).collect();
            json!({
                "if": { "properties": { name: { "const": word } }, "required": [name] },
                "then": {
                    "properties": properties, "required": required(Some(word)), "propertyNames": { "enum": names },
                },
            })
        };
        schema["allOf"] = words.iter().map(of_kind).collect();
    }
    schema
}

/// True if a key belongs to some kinds only, all of them among the words.
fn belongs(key: &Key, words: &[&str]) -> bool {
    !key.kinds.is_empty() && key.kinds.iter().all(|kind| words.contains(kind))
}

fn of_key(key: &'static Key) -> Json {
    let number = |least: f64, most: f64| json!({ "type": "number", "minimum": least, "maximum": most });
    let text = || json!({ "type": "string" });
    let many = |items: Json| json!({ "type": "array", "items": items });
    let mut schema = match key.value {
        Value::Number { least, most, .. } => number(least, most),
        Value::Numbers { count, least, most, .. } => {
            json!({ "type": "array", "items": number(least, most), "minItems": count, "maxItems": count })
        }
        Value::List { least, most, .. } => many(number(least, most)),
        Value::Integer { least, most } => json!({ "type": "integer", "minimum": least, "maximum": most }),
        Value::Flag => json!({ "type": "boolean" }),
        Value::Text(_) | Value::Time => text(),
        Value::Word(words) => json!({ "enum": words() }),
        Value::Words(_) => many(text()),
        Value::Texts(_) => json!({ "anyOf": [text(), many(text())] }),
        Value::Values => {
            json!({ "type": "array", "items": { "type": ["number", "string", "boolean", "array"] }, "minItems": 1 })
        }
        Value::BySatellite(each) => json!({ "type": "object", "additionalProperties": of_key(each) }),
        Value::Table(keys) => object(keys),
        Value::Tables(keys) => many(object(keys)),
        Value::OneOrMore(keys) => json!({ "anyOf": [object(keys), many(object(keys))] }),
        Value::Foreign(_) if key.name == "receiver" => settings(),
        Value::Foreign(_) => json!({ "type": "object" }),
    };
    let words =
        format!("{}: {}. If absent: {}.", key.meaning.trim_end_matches('.'), key.expected(), key.default_text());
    schema["description"] = json!(words);
    if let Absent::Number(number) = key.absent {
        schema["default"] = json!(number);
    }
    schema
}

/// The receiver's settings: types are those of the defaults, ranges are in words.
fn settings() -> Json {
    let kind =
        |default: &str| match format!("x = {default}").parse::<toml::Table>().ok().as_ref().and_then(|t| t.get("x")) {
            Some(toml::Value::Float(_)) => json!("number"),
            Some(toml::Value::Integer(_)) => json!("integer"),
            Some(toml::Value::Boolean(_)) => json!("boolean"),
            Some(toml::Value::Array(_)) => json!("array"),
            _ => json!("string"),
        };
    let of = |key: &receiver::Described| {
        let words = format!("{} Expected: {}. If absent: {}.", key.meaning, key.expected, key.default);
        (key.name.clone(), json!({ "type": kind(&key.default), "description": words }))
    };
    let table = |(name, keys): (String, Vec<receiver::Described>)| {
        let properties: Map<String, Json> = keys.iter().map(of).collect();
        (name, json!({ "type": "object", "properties": properties, "additionalProperties": false }))
    };
    let tables: Map<String, Json> = receiver::tables().into_iter().map(table).collect();
    json!({ "type": "object", "properties": tables, "additionalProperties": false })
}

/// Limits by path, as one key or as tables in tables.
fn limits() -> Json {
    let (mut tree, mut paths, mut patterns) = (Node::default(), Map::new(), Map::new());
    for leaf in leaves() {
        let bound = json!({
            "type": "object", "minProperties": 1, "additionalProperties": false,
            "properties": { "min": { "type": "number" }, "max": { "type": "number" }, "equals": {} },
            "description": format!("{} ({})", leaf.meaning, leaf.unit),
        });
        // Names that are data are any names.
        match leaf.path.contains('*') {
            true => patterns.insert(format!("^{}$", leaf.path.replace('.', "\\.").replace('*', ".+")), bound.clone()),
            false => paths.insert(leaf.path.clone(), bound.clone()),
        };
        let place = leaf.path.split('.').fold(&mut tree, |node, name| node.below.entry(name).or_default());
        place.bound = Some(bound);
    }
    let mut schema = tree.schema();
    if let Some(properties) = schema.get_mut("properties").and_then(Json::as_object_mut) {
        properties.extend(paths);
        let share = json!({ "type": "number", "minimum": 0, "exclusiveMaximum": 1 });
        properties.insert("marginal_share".to_owned(), share);
    }
    schema["patternProperties"] = Json::Object(patterns);
    schema
}

/// A table of limits, or a limit.
#[derive(Default)]
struct Node<'p> {
    below: BTreeMap<&'p str, Node<'p>>,
    bound: Option<Json>,
}

impl Node<'_> {
    fn schema(self) -> Json {
        if let Some(bound) = self.bound {
            return bound;
        }
        let (mut properties, mut others) = (Map::new(), Json::Bool(false));
        for (name, node) in self.below {
            match name {
                "*" => others = node.schema(),
                name => drop(properties.insert(name.to_owned(), node.schema())),
            }
        }
        json!({ "type": "object", "properties": properties, "additionalProperties": others })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_files_in_the_repository_are_what_the_command_prints() {
        for (of, printed) in [
            ("scenario", scenario()),
            ("study", document("Study of gnss-twin", object(STUDY))),
            ("limits", document("Limits of gnss-twin --check", limits())),
            ("receiver", document("Settings of gnss-twin receive", settings())),
        ] {
            let path = format!("{}/assets/{of}.schema.json", env!("CARGO_MANIFEST_DIR"));
            let file = std::fs::read_to_string(path).unwrap_or_default();
            assert!(file == printed, "run `gnss-twin schema {of} > assets/{of}.schema.json`");
        }
    }

    #[test]
    fn a_table_of_kinds_asks_for_the_keys_of_its_kind_and_knows_no_others() {
        let motion = &object(SCENARIO)["properties"]["motion"];
        let kind = |word: &str| {
            let branches = motion["allOf"].as_array().unwrap();
            branches.iter().find(|one| one["if"]["properties"]["kind"]["const"] == word).unwrap()["then"].clone()
        };
        let has = |list: &Json, name: &str| list.as_array().unwrap().iter().any(|one| one == name);
        assert!(has(&kind("static")["required"], "latitude_deg") && !has(&kind("file")["required"], "latitude_deg"));
        assert!(
            !has(&kind("static")["propertyNames"]["enum"], "file")
                && has(&kind("file")["propertyNames"]["enum"], "file")
        );
        assert_eq!(motion["additionalProperties"], false);
    }
}
