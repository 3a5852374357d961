//! Table `[[station]]` as written: receivers under one sky.
//!
//! A scenario with stations is one scenario for each: satellites, messages, atmosphere and emitters are the
//! scene's, and a station's own tables stand in place of the scene's of that name. Of `[power]` a station
//! has single keys, because the satellites' power is common. What is random about a station (noise, clock,
//! scintillation) is keyed by its name, never by its position in the list. Limits: eight stations; no
//! spoofer, no SBAS corrections and no playback, which are made for one antenna each.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::keys::SCENARIO;
use super::keys::station::{NAME, STATION};
use super::read::{Refusals, Source, Table};
use super::{Scenario, ScenarioError};

/// Stations of one scene at most.
const MOST: usize = 8;
/// Letters of a name at most.
const LONGEST_NAME: usize = 32;
/// Tables of the scene that are made for one antenna, and the reason.
const OF_ONE: [(&str, &str); 4] = [
    ("array", "its elements are on one body"),
    ("spoofer", "it has no position from which stations could hear it"),
    ("sbas", "its network lies around one antenna"),
    ("playback", "the transmitter plays the samples of one receiver"),
];

/// Document of the scene at one station.
pub(super) struct Own<'t> {
    /// Name of the station.
    pub name: String,
    /// Tables of the scene, with those that the station replaces.
    pub document: DeTable<'t>,
}

/// Documents of the stations, in order; none in a scene without them.
///
/// # Errors
/// Keys and values of the tables, two equal names, a station without motion, a table of the scene that no
/// station takes or that is made for one antenna.
pub(super) fn each<'t>(source: &Source<'_>, whole: &DeTable<'t>) -> Result<Vec<Own<'t>>, ScenarioError> {
    let root = Table::new(source, "", 0, whole, SCENARIO);
    let Some(tables) = root.tables("station")? else { return Ok(Vec::new()) };
    let mut refusals = Refusals::default();
    if tables.is_empty() || tables.len() > MOST {
        refusals.add(root.bad("station", format!("1 to {MOST} stations, not {}", tables.len())));
    }
    let mut names: Vec<&str> = Vec::new();
    for table in &tables {
        table.check(&mut refusals);
        let Some(name) = refusals.take(table.need_text("name")) else { continue };
        let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if name.len() > LONGEST_NAME || !name.chars().all(fits) {
            refusals.add(table.bad("name", NAME));
        } else if names.iter().any(|other| other.eq_ignore_ascii_case(name)) {
            refusals.add(table.bad("name", "a name that no other station has, capitals apart"));
        }
        names.push(name);
        if !table.has("motion") && !root.has("motion") {
            refusals.add(table.bad("motion", "[station.motion], because the scene has no [motion]"));
        }
    }
    for (name, reason) in OF_ONE.into_iter().filter(|(name, _)| root.has(name)) {
        refusals.add(root.bad(name, format!("nothing beside [[station]]: {reason}")));
    }
    let replaced = STATION.iter().map(|key| key.name).filter(|name| !["name", "power"].contains(name));
    for name in replaced.filter(|name| root.has(name) && tables.iter().all(|table| table.has(name))) {
        refusals.add(root.bad(name, format!("nothing, because every [[station]] has its own {name}")));
    }
    refusals.finish()?;
    let Some(DeValue::Array(items)) = whole.get("station").map(Spanned::get_ref) else { return Ok(Vec::new()) };
    let own = items.iter().zip(names).filter_map(|(item, name)| match item.get_ref() {
        DeValue::Table(table) => Some(Own { name: name.to_owned(), document: document(whole, table) }),
        _ => None,
    });
    Ok(own.collect())
}

/// The scene's document with a station's tables in it.
fn document<'t>(whole: &DeTable<'t>, station: &DeTable<'t>) -> DeTable<'t> {
    let mut document = whole.clone();
    document.remove("station");
    for (key, value) in station.iter().filter(|(key, _)| key.get_ref() != "name") {
        match (document.get_mut(key.get_ref().as_ref()).map(Spanned::get_mut), value.get_ref()) {
            (Some(DeValue::Table(power)), DeValue::Table(own)) if key.get_ref() == "power" => {
                power.extend(own.iter().map(|(key, value)| (key.clone(), value.clone())));
            }
            _ => drop(document.insert(key.clone(), value.clone())),
        }
    }
    document
}

/// Text of the scene that a station of `text` sees: its tables are the scene's, and it is the only station.
/// That scene has the same bytes as the station has among several. `None` if there is no such station, or
/// the text is no TOML.
pub fn text_of(text: &str, name: &str) -> Option<String> {
    let mut whole: toml::Table = toml::from_str(text).ok()?;
    let Some(toml::Value::Array(stations)) = whole.remove("station") else { return None };
    let named = |station: &toml::Value| station.get("name").and_then(toml::Value::as_str) == Some(name);
    let Some(toml::Value::Table(own)) = stations.into_iter().find(named) else { return None };
    for (key, value) in own.into_iter().filter(|(key, _)| key != "name") {
        match (whole.get_mut(&key), value) {
            (Some(toml::Value::Table(power)), toml::Value::Table(own)) if key == "power" => power.extend(own),
            (_, value) => drop(whole.insert(key, value)),
        }
    }
    let only = toml::Table::from_iter([("name".to_owned(), toml::Value::from(name))]);
    whole.insert("station".to_owned(), toml::Value::Array(vec![toml::Value::Table(only)]));
    toml::to_string(&whole).ok()
}

impl Scenario {
    /// The scenario as that of a station.
    pub(super) fn at_station(self, name: &str) -> Self {
        Self { origin: format!("{}, station {name}", self.origin), station: Some(name.to_owned()), ..self }
    }

    /// Scenarios of the stations, in order; a scene without several is its own.
    pub fn each_station(&self) -> &[Self] {
        if self.stations.is_empty() { std::slice::from_ref(self) } else { &self.stations }
    }

    /// Names of the stations, in order.
    pub fn station_names(&self) -> Vec<&str> {
        self.each_station().iter().filter_map(|scenario| scenario.station.as_deref()).collect()
    }

    /// Returns the scenario of one station, which generates the same bytes as among the others.
    ///
    /// # Errors
    /// A name that no station has, with those that there are.
    pub fn with_station(&self, name: &str) -> Result<Self, ScenarioError> {
        let own = self.each_station().iter().find(|scenario| scenario.station.as_deref() == Some(name));
        own.cloned().ok_or_else(|| {
            let known = self.station_names();
            let known = if known.is_empty() { "the scene has none".to_owned() } else { known.join(", ") };
            self.conflict("station.name", format!("none is called {name:?}: {known}"))
        })
    }

    /// Refuses several stations where one scene is composed.
    pub(super) fn one_station(&self) -> Result<(), ScenarioError> {
        if self.stations.is_empty() {
            return Ok(());
        }
        let names = self.station_names();
        let reason = format!(
            "there are {}, {}: expected one here; choose it (--station NAME), or keep one [[station]]",
            names.len(),
            names.join(", ")
        );
        Err(self.conflict("station", reason))
    }

    /// Name of the scene, with that of its station.
    pub(super) fn scene_name(&self) -> String {
        self.station.as_ref().map_or_else(|| self.name.clone(), |station| format!("{}-{station}", self.name))
    }
}

/// Scenario of a document, each station's read by `of`: that of the first station with those of all, that of
/// the only one, or that of the document itself.
///
/// # Errors
/// Refusals of every station.
pub(super) fn scenario(
    source: &Source<'_>,
    document: &DeTable<'_>,
    of: impl Fn(&DeTable<'_>) -> Result<Scenario, ScenarioError>,
) -> Result<Scenario, ScenarioError> {
    let own = each(source, document)?;
    let Some(first) = own.first() else { return of(document) };
    let mut refusals = Refusals::default();
    let mut stations = Vec::with_capacity(own.len());
    for station in &own {
        stations.extend(refusals.take(of(&station.document)).map(|scenario| scenario.at_station(&station.name)));
    }
    refusals.finish()?;
    let whole = of(&first.document)?;
    Ok(match stations.pop() {
        Some(only) if stations.is_empty() => only,
        last => Scenario { stations: stations.into_iter().chain(last).collect(), ..whole },
    })
}
