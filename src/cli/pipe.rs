//! Samples from generator to receiver in memory: bounded, in order, with the waiting time of each end.

use std::io::{self, Read, Write};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{Duration, Instant};

/// The end that the generator writes to.
pub struct Inlet {
    sender: SyncSender<Vec<u8>>,
    /// Time spent waiting for the reader.
    pub waited: Duration,
}

/// The end that the receiver reads from.
pub struct Outlet {
    receiver: Receiver<Vec<u8>>,
    block: Vec<u8>,
    read: usize,
    /// Time spent waiting for the writer.
    pub waited: Duration,
}

/// A pipe that holds at most `blocks` writes.
pub fn pipe(blocks: usize) -> (Inlet, Outlet) {
    let (sender, receiver) = sync_channel(blocks);
    (Inlet { sender, waited: Duration::ZERO }, Outlet { receiver, block: Vec::new(), read: 0, waited: Duration::ZERO })
}

impl Write for Inlet {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let start = Instant::now();
        let sent = self.sender.send(bytes.to_vec());
        self.waited += start.elapsed();
        sent.map(|()| bytes.len()).map_err(|_| io::ErrorKind::BrokenPipe.into())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Read for Outlet {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.read == self.block.len() {
            let start = Instant::now();
            let next = self.receiver.recv();
            self.waited += start.elapsed();
            // The writer is gone: the end of the samples.
            let Ok(block) = next else { return Ok(0) };
            self.block = block;
            self.read = 0;
        }
        let rest = &self.block[self.read..];
        let count = rest.len().min(buffer.len());
        buffer[..count].copy_from_slice(&rest[..count]);
        self.read += count;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_arrive_whole_and_in_order_for_any_read_size_and_a_lost_reader_breaks_the_pipe() {
        let (mut inlet, mut outlet) = pipe(2);
        let sent: Vec<u8> = (0..10_000_u32).map(|x| (x * 7) as u8).collect();
        let copy = sent.clone();
        let writer = std::thread::spawn(move || {
            for chunk in copy.chunks(997) {
                inlet.write_all(chunk).unwrap();
            }
            inlet
        });
        let mut got = Vec::new();
        let mut buffer = [0; 64];
        while got.len() < sent.len() {
            let count = outlet.read(&mut buffer).unwrap();
            got.extend_from_slice(&buffer[..count]);
        }
        assert_eq!(got, sent);
        let mut inlet = writer.join().unwrap();
        drop(outlet);
        assert_eq!(inlet.write(&[1]).unwrap_err().kind(), io::ErrorKind::BrokenPipe);
    }
}
