//! Tests of `[city]`: what is refused, where a model is put, and the shipped street among its paths.

use super::*;
use crate::arrival::seen;
use crate::effect::city::Axes;
use gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS};
use nalgebra::Vector3;

const CITY: &str = "[city]\nfile = \"street.city.json\"\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 128.5\n";

fn composed(lines: &str, directory: &Path) -> Result<crate::scene::Scene, String> {
    let text = format!("{MINIMAL}{STATIC}{lines}");
    let composed = parse(&text).unwrap().compose(directory, &Overrides::default());
    composed.map(|(scene, _)| scene).map_err(|error| error.to_string())
}

fn shipped() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios")
}

#[test]
fn half_of_what_belongs_together_is_refused() {
    let refused =
        |lines: &str| parse(&format!("{MINIMAL}{STATIC}[city]\nfile = \"a\"\n{lines}\n")).unwrap_err().to_string();
    for (lines, part) in [
        ("permittivity = 4", "city.conductivity_spm"),
        ("conductivity_spm = 4", "city.permittivity"),
        ("material = \"brick\"\npermittivity = 4\nconductivity_spm = 1", "no material beside it"),
        ("latitude_deg = 4\nheight_m = 3", "city.longitude_deg"),
        ("longitude_deg = 4\nheight_m = 3", "city.latitude_deg"),
        ("latitude_deg = 4\nlongitude_deg = 4", "city.height_m"),
        ("origin_m = [0, 0, 0]", "city.origin_m"),
        ("lod = \"high\"", "city.lod"),
        ("material = \"stone\"", "one of concrete, brick"),
        ("order = 3", "an integer from 0 to 2"),
    ] {
        assert!(refused(lines).contains(part), "{lines}: {}", refused(lines));
    }
}

#[test]
fn a_file_that_cannot_be_put_anywhere_is_refused_with_what_would_do() {
    let directory = tempfile::tempdir().unwrap();
    let write = |name: &str, crs: &str| {
        let text = std::fs::read_to_string(shipped().join("street.city.json")).unwrap();
        std::fs::write(directory.path().join(name), text.replace("\"title\"", &format!("{crs}\"title\""))).unwrap();
    };
    write("none.json", "");
    write("swiss.json", "\"referenceSystem\":\"https://www.opengis.net/def/crs/EPSG/0/2056\",");
    write("utm.json", "\"referenceSystem\":\"https://www.opengis.net/def/crs/EPSG/0/32644\",");
    let of = |lines: &str| match composed(&format!("[city]\n{lines}\n"), directory.path()) {
        Ok(_) => "composed".to_owned(),
        Err(error) => error,
    };
    assert!(of("file = \"none.json\"").contains("no metadata.referenceSystem: expected latitude_deg"));
    let swiss = of("file = \"swiss.json\"");
    assert!(swiss.contains("EPSG/0/2056") && swiss.contains("expected EPSG 7415 or 28992 (RD New)"), "{swiss}");
    // The zone's origin on the equator is far from Kanpur.
    let utm = of("file = \"utm.json\"");
    assert!(utm.contains("no wall or roof within radius_m = 300 m") && utm.contains("first position"), "{utm}");
    assert!(of("file = \"missing.json\"").contains("cannot be read"));
    assert!(of("file = \"none.json\"\nlod = \"3\"").contains("level of detail 3"));
    let pushed = parse(&format!("{MINIMAL}{PUSHED}{CITY}")).unwrap().compose(&shipped(), &Overrides::default());
    let error = pushed.map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("city: the motion is pushed"), "{error}");
}

#[test]
fn a_model_with_a_reference_system_is_where_that_says() {
    // The street's origin moved to a point of UTM zone 44 near the antenna, by the projection itself.
    let reference = gnss::projection::Reference::of_code(32_644).unwrap();
    let (east_m, north_m) = (420_300.0, 2_931_250.0);
    let corner = reference.geodetic(east_m + 13.0, north_m + 60.0, 128.0);
    let directory = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(shipped().join("street.city.json")).unwrap();
    let text = text.replace("\"translate\":[0,0,0]", &format!("\"translate\":[{east_m},{north_m},0]"));
    let crs = "\"referenceSystem\":\"urn:ogc:def:crs:EPSG::32644\",\"title\"";
    std::fs::write(directory.path().join("utm.json"), text.replace("\"title\"", crs)).unwrap();
    let at = reference.geodetic(east_m, north_m, 130.0);
    let lines = format!(
        "[motion]\nkind = \"static\"\nlatitude_deg = {}\nlongitude_deg = {}\nheight_m = 130\n\
         [city]\nfile = \"utm.json\"\nheight_m = 128\norder = 0\n",
        at.latitude_rad.to_degrees(),
        at.longitude_rad.to_degrees()
    );
    let (scene, _) =
        parse(&format!("{MINIMAL}{lines}")).unwrap().compose(directory.path(), &Overrides::default()).unwrap();
    assert!(scene.effects.iter().any(|effect| effect.name() == "city"));
    // The block's corner at (13, 60, 0) of the file, seen from the antenna: the same by the effect's axes as
    // by ECEF.
    let axes = Axes::at(at.to_ecef());
    let local_m = axes.local_m(&corner.to_ecef());
    assert!((local_m.xy().norm() - libm::hypot(13.0, 60.0)).abs() < 0.05, "{local_m}");
    assert!((local_m.z + 2.0).abs() < 1e-3, "{local_m}");
}

/// The city of the shipped street about the antenna of a scene 95 m up the street.
fn street(lines: &str) -> crate::scene::Scene {
    let origin = Geodetic::from_degrees(26.5, 80.2, 128.5);
    let antenna = Geodetic::from_ecef(&Axes::at(origin.to_ecef()).ecef_m(&Vector3::new(1.0, 95.0, 1.5)));
    let motion = format!(
        "[motion]\nkind = \"static\"\nlatitude_deg = {:.12}\nlongitude_deg = {:.12}\nheight_m = {:.6}\n",
        antenna.latitude_rad.to_degrees(),
        antenna.longitude_rad.to_degrees(),
        antenna.height_m
    );
    let text = format!("{MINIMAL}{motion}{CITY}{lines}");
    parse(&text).unwrap().compose(&shipped(), &Overrides::default()).unwrap().0
}

#[test]
fn rays_of_a_satellite_have_the_delays_of_the_walls_beside_the_antenna() {
    let scene = street("order = 2\n[satellites]\nmask_deg = 5\n");
    let local = scene.clock.epoch(0);
    let mut echoes = 0;
    for sv in scene.satellites() {
        let Some(seen) = seen(&scene, sv, &L1_CA, local).unwrap() else { continue };
        let sight = &seen.emission.sight;
        if sight.look.elevation_rad < 0.1 {
            continue;
        }
        // East block: x = 13 m, 12 m off. West terrace: x = −11 m, 12 m off. Plane waves are 2·12·cos e·|sin
        // a| longer.
        let across = libm::cos(sight.look.elevation_rad) * libm::sin(sight.look.azimuth_rad);
        for ray in seen.rays.iter().skip(1).filter(|ray| ray.cn0_hz > 0.0) {
            let excess_m = (ray.code_delay_s - seen.rays[0].code_delay_s) * SPEED_OF_LIGHT_MPS;
            // One or two walls: 24 m across, and 48 m there and back.
            let by_hand = [2.0 * 12.0 * across.abs(), 2.0 * 24.0 * across.abs()];
            let nearest_m = by_hand.iter().map(|x| (x - excess_m).abs()).fold(f64::INFINITY, f64::min);
            // The sphericity of the wave over 48 m, and a street that lies north of its own axes by 95 m:
            // 1.5e-5 rad. Other rays come from houses up the street.
            echoes += usize::from(nearest_m < 1e-3);
            assert!(excess_m > 0.0, "{sv} {excess_m}");
            assert_eq!(
                ray.code_delay_s - seen.rays[0].code_delay_s,
                ray.carrier_delay_s - seen.rays[0].carrier_delay_s
            );
        }
    }
    assert!(echoes >= 3, "{echoes}");
}

#[test]
fn carriers_of_echoes_run_by_the_rate_of_their_delay() {
    // A walk towards the east block at 1 m/s: the echo of a satellite in the west comes nearer by twice its
    // cosine.
    let origin = Axes::at(Geodetic::from_degrees(26.5, 80.2, 128.5).to_ecef());
    let at = |east_m: f64| Geodetic::from_ecef(&origin.ecef_m(&Vector3::new(east_m, 95.0, 1.5)));
    let point = |place: Geodetic| {
        format!(
            "[[motion.point]]\nlatitude_deg = {:.12}\nlongitude_deg = {:.12}\nheight_m = {:.6}\nspeed_mps = 1\n",
            place.latitude_rad.to_degrees(),
            place.longitude_rad.to_degrees(),
            place.height_m
        )
    };
    let motion = format!("[motion]\nkind = \"waypoints\"\n{}{}", point(at(-9.0)), point(at(11.0)));
    let text = format!("{MINIMAL}{motion}{CITY}order = 1\n");
    let (scene, _) = parse(&text).unwrap().compose(&shipped(), &Overrides::default()).unwrap();
    let mut compared = 0;
    for sv in scene.satellites() {
        let at = |t_s: f64| seen(&scene, sv, &L1_CA, scene.clock.start.plus_s(t_s)).unwrap();
        let (Some(before), Some(now), Some(after)) = (at(4.99), at(5.0), at(5.01)) else { continue };
        let sight = &now.emission.sight;
        let across = libm::cos(sight.look.elevation_rad) * libm::sin(sight.look.azimuth_rad);
        if sight.look.elevation_rad < 0.1 {
            continue;
        }
        for ray in 1..now.rays.len() {
            if now.rays[ray].cn0_hz == 0.0 {
                continue;
            }
            let doppler_hz = -(after.arrivals[ray].carrier_cycles - before.arrivals[ray].carrier_cycles) / 0.02;
            let direct_hz = -(after.arrivals[0].carrier_cycles - before.arrivals[0].carrier_cycles) / 0.02;
            let excess_hz = doppler_hz - direct_hz;
            let delay_s = |seen: &crate::arrival::Seen| seen.rays[ray].code_delay_s - seen.rays[0].code_delay_s;
            let own_hz = -L1_CA.carrier_hz(sv) * (delay_s(&after) - delay_s(&before)) / 0.02;
            // Fresnel's phase turns by less than a thousandth of a cycle in 20 ms.
            assert!((excess_hz - own_hz).abs() < 0.05, "{sv} {ray}: {excess_hz} {own_hz}");
            // The excess is 2 d |across|. A satellite in the east has the western wall, from which d grows by
            // 1 m/s; one in the west, where `across` is negative, has the eastern wall, to which d shrinks.
            // Other rays come from walls across the street.
            let expected_hz = -2.0 * across / L1_CA.wavelength_m(sv);
            compared += usize::from((excess_hz - expected_hz).abs() < 0.05);
        }
    }
    assert!(compared >= 2, "{compared}");
}

#[test]
fn the_list_of_rays_is_the_same_at_all_times_and_says_what_it_is() {
    let scene = street("order = 2\n");
    let lengths = |t_s: f64| -> Vec<usize> {
        let local = scene.clock.start.plus_s(t_s);
        scene.satellites().filter_map(|sv| Some(seen(&scene, sv, &L1_CA, local).unwrap()?.rays.len())).collect()
    };
    assert_eq!(lengths(0.0), lengths(9.9));
    let city = scene.effects.iter().find(|effect| effect.name() == "city").unwrap();
    assert!(city.describe().contains("of concrete: the direct ray is obstructed"), "{}", city.describe());
}
