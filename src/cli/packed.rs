//! Flags that say how samples lie in a recording: over what its metadata say, and as they are to be written.

use clap::Args;

use crate::cli::error::CliError;
use generator::scene::Scene;
use gnss::facts::StageSpec;
use gnss::packed::{Components, Encoding, Interleaved, Layout};
use gnss::recording::Samples;

/// Samples of a few bits.
#[derive(Args, Clone, Debug, Default)]
pub struct Bits {
    /// Bits per value of packed samples: 1, 2, 3, 4, 8 or 16. Samples are complex and start in the highest
    /// bits of each byte unless other flags say so
    #[arg(long, value_name = "N", conflicts_with = "format")]
    bits: Option<u32>,
    /// Encoding of packed values: sign, negative-sign (1 is negative), sign-magnitude, twos-complement or
    /// offset [default: twos-complement; sign for 1 bit]
    #[arg(long, requires = "bits")]
    encoding: Option<Encoding>,
    /// Packed samples have quadrature before in-phase
    #[arg(long, requires = "bits")]
    qi: bool,
    /// Packed samples start in the lowest bits
    #[arg(long, requires = "bits")]
    lowest_first: bool,
    /// Bytes per packed word: 1, 2, 4 or 8
    #[arg(long, requires = "bits", value_name = "N", default_value_t = 1)]
    word_bytes: usize,
    /// Packed words have the highest byte first
    #[arg(long, requires = "bits")]
    big_endian: bool,
}

impl Bits {
    /// True if samples are packed.
    pub fn given(&self) -> bool {
        self.bits.is_some()
    }

    /// Layout of the samples of one channel in the file, real or complex. `None` without a flag for it.
    fn interleaved(&self, real: bool) -> Result<Option<Interleaved>, CliError> {
        let Some(bits) = self.bits else { return Ok(None) };
        let components = match (real, self.qi) {
            (true, true) => return Err(CliError::usage("--qi: real samples have no quadrature")),
            (true, false) => Components::Real,
            (false, true) => Components::Qi,
            (false, false) => Components::Iq,
        };
        Ok(Some(Interleaved {
            bits,
            encoding: self.encoding.unwrap_or(if bits == 1 { Encoding::Sign } else { Encoding::TwosComplement }),
            components,
            lowest_first: self.lowest_first,
            word_bytes: self.word_bytes,
            big_endian: self.big_endian,
            channels: 1,
            channel: 1,
        }))
    }

    /// Layout of the samples of a scene in packed form. `None` without a flag for it.
    ///
    /// # Errors
    ///
    /// A scene whose converter has other levels, and samples that do not fill whole words.
    pub fn of_scene(&self, scene: &Scene, samples: u64) -> Result<Option<(Interleaved, Layout)>, CliError> {
        let format = scene.metadata.format;
        let Some(of) = self.interleaved(!format.is_complex())? else { return Ok(None) };
        let layout = Layout::interleaved(&of).map_err(CliError::usage)?;
        let refuse = |what: String| Err(CliError::usage(format!("--bits {}: {what}", of.bits)));
        if layout.format() != format {
            return refuse(format!("the scene's format is {format}: expected {}", layout.format()));
        }
        let levels = scene.front_end.iter().find_map(|stage| match stage.spec() {
            Some(StageSpec::Adc(converter)) if !converter.whole => Some(converter.bits),
            _ => None,
        });
        if levels != Some(of.bits) {
            let has = levels.map_or_else(|| "has none".to_owned(), |bits| format!("has {bits} bits"));
            return refuse(format!("the scene's converter {has}: expected a table adc with bits = {}", of.bits));
        }
        let group = layout.group_samples() as u64;
        if !samples.is_multiple_of(group) {
            return refuse(format!("{samples} samples are no multiple of the {group} that fill a word: use --samples"));
        }
        Ok(Some((of, layout)))
    }
}

/// Samples of a few bits, and channels.
#[derive(Args, Clone, Debug, Default)]
pub struct Packed {
    #[command(flatten)]
    of: Bits,
    /// Packed samples are real
    #[arg(long, requires = "bits", conflicts_with = "qi")]
    real: bool,
    /// Number of channels interleaved in the file, one sample each in turn
    #[arg(long, value_name = "N")]
    channels: Option<u32>,
    /// Channel to receive: its number from 1, or the name of a stream in ION metadata
    #[arg(long, value_name = "K")]
    pub channel: Option<String>,
}

impl Packed {
    /// The flag that says how samples lie in the file, if one does.
    pub fn given(&self) -> Option<&'static str> {
        let flags = [("--bits", self.of.bits.is_some()), ("--channels", self.channels.is_some())];
        let more = [("--channel", self.channel.is_some())];
        flags.into_iter().chain(more).find_map(|(flag, given)| given.then_some(flag))
    }

    /// The samples that the flags describe, over those that metadata do: of one channel.
    pub fn over(&self, described: Option<Samples>, channels: u32) -> Result<Option<Samples>, CliError> {
        let samples = self.of.interleaved(self.real)?.map(Samples::Interleaved).or(described);
        let Some(samples) = samples else { return Ok(None) };
        let channels = self.channels.unwrap_or(channels);
        let channel = match &self.channel {
            None if channels > 1 => {
                let text = format!("there are {channels} channels: choose one by --channel 1 to {channels}");
                return Err(CliError::usage(text));
            }
            None => 1,
            Some(word) => word.parse().map_err(|_| CliError::usage(format!("--channel {word}: expected a number")))?,
        };
        // Bits as they are laid out may be refused with or without several channels.
        let samples = samples.of_channel(channel, channels);
        samples.map(Some).map_err(|error| CliError::usage(error.to_string()))
    }
}
