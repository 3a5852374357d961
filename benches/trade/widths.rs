//! Cost and losses of the width of samples and of the quality of noise.
//!
//! One satellite in the noise of a second at 2.6 Msps is made as `cf32` with noise in f64, and then in each
//! narrower form of the same seed. The difference is the rounding. C/N0 is the correlated amplitude's square
//! over the mean power of the samples; the code is a discriminator over 20 ms.

use analysis::show::trade::Width;
use analysis::statistics::{mean, median};
use generator::scene::{Arithmetic, CodeEdge, Fidelity, Grade};
use generator::stream::{Options, generate_with};
use generator::truth;
use gnss::samples::Format;
use num_complex::Complex;

use super::{CHIP_M, Replicas, STATIC, Site, busy_s, correlate, pieces, scene};

const SITE: Site = Site { error_s: 3.0, time_s: 6.0, ..STATIC };

/// Format, converter, and what the noise is computed in.
struct Setting {
    name: &'static str,
    format: &'static str,
    tables: &'static str,
    noise: Arithmetic,
}

const SETTINGS: [Setting; 9] = [
    Setting { name: "cf32, noise f64", format: "cf32", tables: "", noise: Arithmetic::F64 },
    Setting { name: "cf32", format: "cf32", tables: "", noise: Arithmetic::F32 },
    Setting { name: "ci16", format: "ci16", tables: "", noise: Arithmetic::F32 },
    Setting { name: "ci8, noise f64", format: "ci8", tables: "", noise: Arithmetic::F64 },
    Setting { name: "ci8", format: "ci8", tables: "", noise: Arithmetic::F32 },
    Setting { name: "ci8, adc 8 bits", format: "ci8", tables: "[adc]\nbits = 8\n", noise: Arithmetic::F32 },
    Setting { name: "ci8, adc 4 bits", format: "ci8", tables: "[adc]\nbits = 4\n", noise: Arithmetic::F32 },
    Setting { name: "ci8, adc 2 bits", format: "ci8", tables: "[adc]\nbits = 2\n", noise: Arithmetic::F32 },
    Setting { name: "ci8, adc 1 bit", format: "ci8", tables: "[adc]\nbits = 1\n", noise: Arithmetic::F32 },
];

impl Setting {
    fn site(&self) -> Site {
        Site { tables: self.tables, ..SITE }
    }

    fn fidelity(&self) -> Fidelity {
        Fidelity { noise: self.noise, code_edge: CodeEdge::Area, ..Fidelity::of(Grade::Balanced) }
    }

    /// Samples of the satellite in noise.
    fn samples(&self, replicas: &Replicas) -> Vec<Complex<f32>> {
        let mut scene = scene(self.site(), self.fidelity(), SITE.error_s, self.format, true);
        scene.excluded = scene.catalogue.satellites().filter(|other| *other != replicas.sv).collect();
        let directory = tempfile::tempdir().unwrap();
        let mut bytes = Vec::new();
        let mut writer = truth::Writer::create(directory.path()).unwrap();
        generate_with(&scene, &mut bytes, &mut writer, &mut |_| (), &Options::default()).unwrap();
        let (mut i, mut q) = (Vec::new(), Vec::new());
        scene.metadata.format.unpack(&bytes, &mut i, &mut q);
        i.into_iter().zip(q).map(|(i, q)| Complex::new(i, q)).collect()
    }

    /// Time of a sample of the whole scene, and of one without noise and converter in the same format.
    fn once_ns(&self) -> (f64, f64) {
        let of = |site: Site, noise: bool| {
            let scene = scene(site, self.fidelity(), SITE.time_s, self.format, noise);
            let directory = tempfile::tempdir().unwrap();
            let mut writer = truth::Writer::create(directory.path()).unwrap();
            let start = std::time::Instant::now();
            let before_s = busy_s(start);
            let done =
                generate_with(&scene, &mut std::io::sink(), &mut writer, &mut |_| (), &Options::default()).unwrap();
            (busy_s(start) - before_s) * 1e9 / done.samples as f64
        };
        (of(self.site(), true), of(SITE, false))
    }
}

/// Every setting against the first.
pub fn measure() -> Vec<Width> {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let mut times = SETTINGS.map(|_| (Vec::new(), Vec::new()));
    for _ in 0..7 {
        for (setting, (whole, bare)) in SETTINGS.iter().zip(&mut times) {
            let (with, without) = one.install(|| setting.once_ns());
            whole.push(with);
            bare.push(without);
        }
    }
    let first = scene(SITE, Fidelity::of(Grade::Reference), 1.0, "cf32", false);
    let sv = (first.catalogue.satellites())
        .find(|sv| !first.excluded.contains(sv) && truth::in_view(&first, *sv, first.clock.start).unwrap())
        .unwrap();
    let replicas = Replicas::new(SITE, sv);
    let length = (SITE.rate_msps * 1e3) as usize;
    let mut reference: Option<(Vec<Complex<f32>>, f64, Vec<f64>)> = None;
    let mut rows = Vec::new();
    for (setting, (whole, bare)) in SETTINGS.iter().zip(&times) {
        let samples = setting.samples(&replicas);
        let power = samples.iter().map(|x| f64::from(x.norm_sqr())).sum::<f64>() / samples.len() as f64;
        let z = pieces(&correlate(&samples, &replicas.prompt, length));
        // The data bits turn whole pieces: the carrier is the replica's own.
        let amplitude = z.iter().map(|z| z.re.abs()).sum::<f64>() / z.len() as f64;
        let cn0 = amplitude.powi(2) / power;
        let code: Vec<f64> =
            (replicas.discriminator(&samples, SITE).iter()).map(|d| d / replicas.slope * CHIP_M).collect();
        let (exact, exact_cn0, exact_code) = reference.get_or_insert_with(|| (samples.clone(), cn0, code.clone()));
        let scale = {
            let cross = samples.iter().zip(&*exact).map(|(a, b)| f64::from((a * b.conj()).re)).sum::<f64>();
            cross / exact.iter().map(|x| f64::from(x.norm_sqr())).sum::<f64>()
        };
        let squares = samples.iter().zip(&*exact).map(|(a, b)| {
            let (re, im) = (f64::from(a.re) / scale - f64::from(b.re), f64::from(a.im) / scale - f64::from(b.im));
            re * re + im * im
        });
        let error = (squares.sum::<f64>()
            / samples.len() as f64
            / (exact.iter().map(|x| f64::from(x.norm_sqr())).sum::<f64>() / exact.len() as f64))
            .sqrt();
        let apart: Vec<f64> = code.iter().zip(&*exact_code).map(|(a, b)| a - b).collect();
        let middle = mean(&apart).unwrap();
        let variance = mean(&apart.iter().map(|x| (x - middle).powi(2)).collect::<Vec<_>>()).unwrap();
        let format: Format = setting.format.parse().unwrap();
        let row = Width {
            setting: setting.name.to_owned(),
            bytes: format.bytes(),
            ns: median(whole).unwrap(),
            stages_ns: median(&whole.iter().zip(bare).map(|(a, b)| a - b).collect::<Vec<_>>()).unwrap(),
            sample_error: error,
            cn0_loss_db: 10.0 * libm::log10(*exact_cn0 / cn0),
            code_mean_m: middle,
            code_sigma_m: variance.sqrt(),
        };
        println!("{row}");
        rows.push(row);
    }
    rows
}
