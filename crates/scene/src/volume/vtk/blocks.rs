//! The bytes of an array: base64 undone, the header read, blocks decompressed.

use std::io::{self, ErrorKind, Read};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;

/// How a file packs bytes.
#[derive(Clone, Copy)]
pub(super) struct Layout {
    /// Of headers and of values.
    pub big_endian: bool,
    /// Whether headers are of 64 bits, not 32.
    pub wide: bool,
    pub codec: Option<Codec>,
}

/// How blocks are compressed.
#[derive(Clone, Copy)]
pub(super) enum Codec {
    Zlib,
    Lz4,
}

/// The largest block that is decompressed [bytes]; VTK's own have 32 KiB by default.
const MOST_BLOCK: u64 = 1 << 26;

/// LZ4 makes no more bytes than this of one.
const MAX_LZ4_RATIO: u64 = 255;

impl Layout {
    /// The bytes of the array that begins where `source` does.
    pub fn open<'f>(self, mut source: impl Read + 'f) -> io::Result<Box<dyn Read + 'f>> {
        let first = self.header(&mut source)?;
        let Some(codec) = self.codec else { return Ok(Box::new(source.take(first))) };
        let [size, last] = [self.header(&mut source)?, self.header(&mut source)?];
        if size.max(last) > MOST_BLOCK {
            let message = format!("a block of {} bytes; accepted: at most {MOST_BLOCK}", size.max(last));
            return Err(invalid(message));
        }
        let mut sizes = Vec::new();
        for _ in 0..first {
            sizes.push(self.header(&mut source)?);
        }
        let last = if last == 0 { size } else { last };
        let (sizes, compressed, block) = (sizes.into_iter(), Vec::new(), io::Cursor::new(Vec::new()));
        Ok(Box::new(Blocks { source, codec, size, last, sizes, compressed, block }))
    }

    fn header(self, source: &mut impl Read) -> io::Result<u64> {
        let mut bytes = [0; 8];
        let bytes = &mut bytes[..if self.wide { 8 } else { 4 }];
        source.read_exact(bytes)?;
        if self.big_endian {
            bytes.reverse();
        }
        Ok(bytes.iter().rev().fold(0, |number, &byte| number << 8 | u64::from(byte)))
    }
}

/// Compressed blocks, decompressed one after the other.
struct Blocks<R> {
    source: R,
    codec: Codec,
    /// Bytes of a block, and of the last.
    size: u64,
    last: u64,
    /// Compressed bytes of the blocks to come.
    sizes: std::vec::IntoIter<u64>,
    compressed: Vec<u8>,
    block: io::Cursor<Vec<u8>>,
}

impl<R: Read> Read for Blocks<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        loop {
            let count = self.block.read(out)?;
            if count > 0 || out.is_empty() {
                return Ok(count);
            }
            let Some(compressed) = self.sizes.next() else { return Ok(0) };
            self.decompress(compressed, if self.sizes.len() == 0 { self.last } else { self.size })?;
        }
    }
}

impl<R: Read> Blocks<R> {
    fn decompress(&mut self, compressed: u64, size: u64) -> io::Result<()> {
        self.compressed.clear();
        if (&mut self.source).take(compressed).read_to_end(&mut self.compressed)? as u64 != compressed {
            return Err(ErrorKind::UnexpectedEof.into());
        }
        let block = self.block.get_mut();
        block.clear();
        let found = match self.codec {
            Codec::Zlib => ZlibDecoder::new(&self.compressed[..]).take(size + 1).read_to_end(block)?,
            Codec::Lz4 if size > MAX_LZ4_RATIO.saturating_mul(compressed) => 0,
            Codec::Lz4 => {
                block.resize(size as usize, 0);
                lz4_flex::block::decompress_into(&self.compressed, block).map_err(|error| invalid(error.to_string()))?
            }
        };
        if found as u64 != size {
            return Err(invalid(format!("a block of {found} bytes where its header says {size}")));
        }
        self.block.set_position(0);
        Ok(())
    }
}

/// Base64 text, decoded as it is read. It ends at a `<`; white space does not count; padding may end a part of it, after
/// which another begins, as where a header is encoded for itself.
pub(super) struct Base64<'f> {
    text: &'f [u8],
    decoded: io::Cursor<Vec<u8>>,
}

impl<'f> Base64<'f> {
    pub fn new(text: &'f [u8]) -> Self {
        Self { text, decoded: io::Cursor::default() }
    }

    /// The next characters: at most some thousand, up to padding.
    fn part(&mut self) -> Vec<u8> {
        const MOST: usize = 1 << 12;
        let mut part = Vec::with_capacity(MOST);
        while let Some((&character, rest)) = self.text.split_first() {
            if character == b'<' || part.len() == MOST {
                break;
            }
            self.text = rest;
            if !character.is_ascii_whitespace() {
                part.push(character);
            }
            if character == b'=' && part.len() % 4 == 0 {
                break;
            }
        }
        part
    }
}

impl Read for Base64<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let count = self.decoded.read(out)?;
        if count > 0 || out.is_empty() {
            return Ok(count);
        }
        let part = self.part();
        let decoded = self.decoded.get_mut();
        decoded.clear();
        STANDARD.decode_vec(part, decoded).map_err(|error| invalid(format!("base64: {error}")))?;
        self.decoded.set_position(0);
        self.decoded.read(out)
    }
}

fn invalid(message: String) -> io::Error {
    io::Error::new(ErrorKind::InvalidData, message)
}
