//! Flags that say how samples lie in a recording, over what its metadata say.

use clap::Args;

use crate::cli::error::CliError;
use crate::gnss::packed::{Components, Encoding, Interleaved};
use crate::gnss::recording::Samples;

/// Samples of a few bits, and channels.
#[derive(Args, Clone, Debug, Default)]
pub struct Packed {
    /// Bits of a value of packed samples: 1, 2, 3, 4, 8 or 16. Complex and first in the highest bits of each
    /// byte unless other flags say so
    #[arg(long, value_name = "N", conflicts_with = "format")]
    bits: Option<u32>,
    /// How packed values are written: sign, negative-sign (1 is negative), sign-magnitude, twos-complement or
    /// offset [default: twos-complement, of 1 bit sign]
    #[arg(long, requires = "bits")]
    encoding: Option<Encoding>,
    /// Packed samples are real
    #[arg(long, requires = "bits")]
    real: bool,
    /// Of packed samples, quadrature comes before in-phase
    #[arg(long, requires = "bits", conflicts_with = "real")]
    qi: bool,
    /// Packed values begin in the lowest bits
    #[arg(long, requires = "bits")]
    lowest_first: bool,
    /// Bytes of the words in which values are packed: 1, 2, 4 or 8
    #[arg(long, requires = "bits", value_name = "N", default_value_t = 1)]
    word_bytes: usize,
    /// The highest byte of a word comes first
    #[arg(long, requires = "bits")]
    big_endian: bool,
    /// Channels of a file, a sample of each in turn
    #[arg(long, value_name = "N")]
    channels: Option<u32>,
    /// The channel that is received: its number, from 1, or the name of a stream of ION's metadata
    #[arg(long, value_name = "K")]
    pub channel: Option<String>,
}

impl Packed {
    /// The flag that says how samples lie in the file, if one does.
    pub fn given(&self) -> Option<&'static str> {
        let flags = [("--bits", self.bits.is_some()), ("--channels", self.channels.is_some())];
        let more = [("--channel", self.channel.is_some())];
        flags.into_iter().chain(more).find_map(|(flag, given)| given.then_some(flag))
    }

    /// The samples that the flags describe, over those that metadata do: of one channel.
    pub fn over(&self, described: Option<Samples>, channels: u32) -> Result<Option<Samples>, CliError> {
        let samples = match self.bits {
            None => described,
            Some(bits) => Some(Samples::Interleaved(Interleaved {
                bits,
                encoding: self.encoding.unwrap_or(if bits == 1 { Encoding::Sign } else { Encoding::TwosComplement }),
                components: match (self.real, self.qi) {
                    (true, _) => Components::Real,
                    (_, true) => Components::Qi,
                    _ => Components::Iq,
                },
                lowest_first: self.lowest_first,
                word_bytes: self.word_bytes,
                big_endian: self.big_endian,
                channels: 1,
                channel: 1,
            })),
        };
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
