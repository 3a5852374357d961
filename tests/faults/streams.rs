//! Fuzzing of receivers' binary protocols: bent streams, and messages whose content is bent and whose check
//! holds.
//!
//! A frame whose check fails is skipped and counted, and costs no other: what follows a bent stream is read
//! as if nothing were before it, wherever the stream begins and in whatever pieces it comes. Bent
//! content never reaches a decoder through a check of 24 bits, so it is framed again; no decoder may panic.

use std::io::{Cursor, Read};
use std::path::Path;

use gnss::time::Epoch;
use logs::frames::{Protocol, crc_ccitt, fletcher};
use logs::log::{Log, Message};
use logs::observed::Event;
use logs::rtcm::framed;

use crate::fuzz::{Target, hashed, run};

/// Runs of a stream, and of a message.
const STREAMS: (usize, usize) = (200_000, 1000);
const MESSAGES: (usize, usize) = (1_000_000, 4000);
/// Most bytes of a stream of the corpus.
const LONGEST: usize = 700;
/// Bytes of a body of zeros, which bending fills.
const ZEROS: usize = 180;
/// Blocks of SBF that are decoded: MeasEpoch, PVTGeodetic, PVTCartesian and ReceiverTime.
const BLOCKS: [u16; 4] = [4027, 4007, 4006, 5914];

fn shipped(name: &str) -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("data/witness/logs").join(name)).unwrap()
}

fn near() -> Option<Epoch> {
    Epoch::parse("2024-03-14T00:00:00").ok()
}

/// A stream that comes in pieces of 1 to 97 bytes.
struct Dripping<'a>(&'a [u8], usize);

impl Read for Dripping<'_> {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        self.1 = (31 * self.1 + 7) % 97 + 1;
        let count = self.1.min(into.len()).min(self.0.len());
        into[..count].copy_from_slice(&self.0[..count]);
        self.0 = &self.0[count..];
        Ok(count)
    }
}

/// Messages of a stream, after a look at what they say.
fn messages(input: impl Read, length: usize) -> Result<Vec<Message>, String> {
    let mut log = Log::new(input, near());
    let all: Vec<Message> = log.by_ref().collect::<Result<_, _>>().map_err(|error| error.to_string())?;
    let contents = log.contents();
    let counted: u64 = contents.messages.iter().map(|(_, _, tally)| tally.count).sum();
    let framed: u64 = contents.protocols.iter().map(|(_, count)| count.frames).sum();
    if counted != all.len() as u64 || framed != counted || contents.skipped_bytes > length as u64 {
        return Err(format!("{} messages, and {contents:?}", all.len()));
    }
    for message in &all {
        if let Some(Event::Observations(epoch)) = &message.event {
            let numbers = epoch.values.iter().flat_map(|own| [own.pseudorange_m, own.carrier_cycles, own.doppler_hz]);
            if numbers.flatten().any(|number| !number.is_finite()) {
                return Err(format!("not finite: {epoch:?}"));
            }
        }
    }
    Ok(all)
}

/// Frame of UBX of a class, a number and a payload.
fn ubx(body: &[u8]) -> Vec<u8> {
    let payload = body.get(2..).unwrap_or_default();
    let payload = &payload[..payload.len().min(8192)];
    let mut frame = vec![0xb5, 0x62];
    frame.extend((0..2).map(|at| body.get(at).copied().unwrap_or(0)));
    frame.extend((payload.len() as u16).to_le_bytes());
    frame.extend(payload);
    let check = fletcher(&frame[2..]);
    frame.extend(check);
    frame
}

/// Block of SBF of a number and a body.
fn sbf(body: &[u8]) -> Vec<u8> {
    let mut rest: Vec<u8> = (0..2).map(|at| body.get(at).copied().unwrap_or(0)).collect();
    let content = body.get(2..).unwrap_or_default();
    let length = 8 + content.len().min(16_000).next_multiple_of(4);
    rest.extend((length as u16).to_le_bytes());
    rest.extend(content.iter().take(16_000));
    rest.resize(length - 4, 0);
    let mut block = b"$@".to_vec();
    block.extend(crc_ccitt(&rest).to_le_bytes());
    block.extend(rest);
    block
}

/// Bodies of a protocol's frames in shipped logs: all between the first bytes and the check.
fn bodies(names: &[&str], protocol: Protocol, [head, check]: [usize; 2]) -> Vec<Vec<u8>> {
    let mut found = Vec::new();
    for name in names {
        let bytes = shipped(name);
        for frame in logs::frames::Frames::new(Cursor::new(bytes)).map(Result::unwrap) {
            if frame.protocol == protocol {
                found.push(frame.bytes[head..frame.bytes.len() - check].to_vec());
            }
        }
    }
    found
}

/// Reads one message whose content is bent, framed by `frame`.
fn content(frame: fn(&[u8]) -> Vec<u8>) -> impl Fn(&[u8]) -> Result<u64, String> {
    move |bytes| {
        let whole = frame(bytes);
        let all = messages(Cursor::new(&whole), whole.len())?;
        if all.len() == 1 { Ok(hashed(all)) } else { Err(format!("{} messages in one frame", all.len())) }
    }
}

/// Reads a bent stream with a sound one behind it.
fn stream(sound: Vec<u8>) -> impl Fn(&[u8]) -> Result<u64, String> {
    let said = |all: &[Message]| hashed(all.iter().map(|own| (&own.name, &own.table)).collect::<Vec<_>>());
    let alone = messages(Cursor::new(&sound), sound.len()).unwrap();
    move |bytes| {
        let whole = [bytes, sound.as_slice()].concat();
        let all = messages(Cursor::new(&whole), whole.len())?;
        let dripped = messages(Dripping(&whole, 0), whole.len())?;
        if dripped != all {
            return Err("a stream in pieces says something else".to_owned());
        }
        let behind = all.len().checked_sub(alone.len()).ok_or("frames are lost behind a bent stream")?;
        if said(&all[behind..]) != said(&alone) {
            return Err("sound messages say something else behind a bent stream".to_owned());
        }
        Ok(hashed(all))
    }
}

#[test]
fn whatever_comes_from_a_receiver_its_messages_are_read_or_counted_as_damaged() {
    let mut long = shipped("NTRIP-USCL00CHL0.rtcm3");
    let tail = long.split_off(long.len() - LONGEST);
    long.truncate(LONGEST);
    let ubx_logs = ["NAV.ubx", "RXM.ubx", "RXMRAWX.ubx", "NAV-ZED-X20P.ubx"];
    let mut of_ubx = bodies(&ubx_logs, Protocol::Ubx, [2, 2]);
    // The length is made again.
    of_ubx.iter_mut().for_each(|body| drop(body.drain(2..4)));
    let of_sbf = BLOCKS.iter().map(|number| [number.to_le_bytes().as_slice(), &[0; ZEROS]].concat()).collect();
    let rtcm_logs = ["MIXED-RTCM3.rtcm3", "NTRIP-USCL00CHL0.rtcm3", "RTCM3.rtcm3", "1230.rtcm3"];
    let target = |name, corpus, runs, read| Target { name, corpus, prefix: "refused: ".to_owned(), runs, read };
    let targets = [
        target("RTCM 3, stream", vec![tail, long], STREAMS, Box::new(stream(shipped("1230.rtcm3")))),
        target("RTCM 3, messages", bodies(&rtcm_logs, Protocol::Rtcm, [3, 3]), MESSAGES, Box::new(content(framed))),
        target("UBX, messages", of_ubx, MESSAGES, Box::new(content(ubx))),
        target("SBF, messages", of_sbf, MESSAGES, Box::new(content(sbf))),
    ];
    let failures: Vec<String> = targets.iter().filter_map(|target| run(target).err()).collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
