//! Decompresses chunks of Blosc 1, as OpenVDB writes them.
//!
//! Source of the format: c-blosc, README_CHUNK_FORMAT.rst. A chunk is a header of 16 bytes, the start of every block,
//! and the blocks. A block is one stream, or one for each byte of a value ("split"); a stream follows its length, and
//! is stored as it is where that length is that of its content. A filter ("shuffle") may have put the first bytes of
//! all values first, then the second ones, and so on.

use std::io::Read;

use crate::volume::VolumeError;

const HEADER: usize = 16;
const SHUFFLE: u8 = 0x01;
const STORED: u8 = 0x02;
const BIT_SHUFFLE: u8 = 0x04;
const RESERVED: u8 = 0x08;
const NEVER_SPLIT: u8 = 0x10;

/// Values wider than this, or blocks of fewer values than that, are never split.
const MAX_SPLITS: usize = 16;
const MIN_SPLIT: usize = 128;

/// Decompresses `chunk` into all of `out`.
///
/// Errors: [`VolumeError::Corrupt`] if the chunk is malformed or does not hold `out.len()` bytes;
/// [`VolumeError::Unsupported`] for a codec or filter other than `blosclz`, `lz4`, `zlib`, byte shuffle.
pub(in crate::volume) fn decompress(chunk: &[u8], out: &mut [u8]) -> Result<(), VolumeError> {
    let header: &[u8; HEADER] = chunk.first_chunk().ok_or_else(|| corrupt("is shorter than its header of 16 bytes"))?;
    let [version, _, flags, width, sizes @ ..] = *header;
    let size = |i: usize| u32::from_le_bytes([sizes[i], sizes[i + 1], sizes[i + 2], sizes[i + 3]]) as usize;
    let (total, block_size, chunk_size) = (size(0), size(4), size(8));
    if version != 2 || flags & RESERVED != 0 {
        return Err(VolumeError::Unsupported {
            found: format!("a Blosc chunk of version {version}, flags {flags:#04x}"),
            accepted: "version 2 without reserved flags",
        });
    }
    if total != out.len() {
        return Err(corrupt(format!("holds {total} bytes; expected are {}", out.len())));
    }
    if total == 0 {
        return Ok(());
    }
    let chunk = chunk.get(..chunk_size).ok_or_else(|| corrupt(format!("says it has {chunk_size} bytes")))?;
    if flags & STORED != 0 {
        let content = chunk.get(HEADER..).filter(|content| content.len() == total);
        out.copy_from_slice(content.ok_or_else(|| corrupt("is stored, but has another size than its content"))?);
        return Ok(());
    }
    if flags & BIT_SHUFFLE != 0 {
        return Err(VolumeError::Unsupported {
            found: "Blosc's bit shuffle".into(),
            accepted: "its byte shuffle, or none",
        });
    }
    let codec = Codec::new(flags >> 5)?;
    let width = usize::from(width);
    if width == 0 || block_size == 0 || block_size > total {
        return Err(corrupt(format!("has values of {width} bytes in blocks of {block_size}")));
    }

    let shuffled = flags & SHUFFLE != 0 && width > 1;
    let mut planes = vec![0; if shuffled { block_size } else { 0 }];
    for (i, block) in out.chunks_mut(block_size).enumerate() {
        let start = chunk.get(HEADER + 4 * i..).and_then(|starts| starts.first_chunk());
        let start = u32::from_le_bytes(*start.ok_or_else(|| corrupt("ends within the starts of its blocks"))?);
        let streams = chunk.get(start as usize..).ok_or_else(|| corrupt("has a block beyond its end"))?;
        let whole = block.len() == block_size;
        let split = flags & NEVER_SPLIT == 0 && width <= MAX_SPLITS && block_size / width >= MIN_SPLIT && whole;
        let count = if split { width } else { 1 };
        if shuffled {
            let planes = &mut planes[..block.len()];
            read_streams(codec, streams, count, planes)?;
            unshuffle(width, planes, block);
        } else {
            read_streams(codec, streams, count, block)?;
        }
    }
    Ok(())
}

/// Decompresses `count` streams of equal content into `block`.
fn read_streams(codec: Codec, mut streams: &[u8], count: usize, block: &mut [u8]) -> Result<(), VolumeError> {
    if !block.len().is_multiple_of(count) {
        return Err(corrupt(format!("splits a block of {} bytes into {count}", block.len())));
    }
    let size = block.len() / count;
    for content in block.chunks_exact_mut(size) {
        let (length, rest) = streams.split_first_chunk().ok_or_else(|| corrupt("ends within a block"))?;
        let (stream, rest) = rest
            .split_at_checked(u32::from_le_bytes(*length) as usize)
            .ok_or_else(|| corrupt("ends within a stream"))?;
        if stream.len() == content.len() {
            content.copy_from_slice(stream);
        } else if !codec.decompress(stream, content) {
            return Err(corrupt(format!("has a malformed {codec:?} stream")));
        }
        streams = rest;
    }
    Ok(())
}

/// Undoes the byte shuffle; a tail shorter than a value stands as it is.
fn unshuffle(width: usize, planes: &[u8], values: &mut [u8]) {
    let count = values.len() / width;
    let (whole, tail) = values.split_at_mut(count * width);
    for (i, value) in whole.chunks_exact_mut(width).enumerate() {
        for (byte, plane) in value.iter_mut().zip(planes.chunks_exact(count)) {
            *byte = plane[i];
        }
    }
    tail.copy_from_slice(&planes[count * width..]);
}

#[derive(Debug, Clone, Copy)]
enum Codec {
    BloscLz,
    Lz4,
    Zlib,
}

impl Codec {
    fn new(code: u8) -> Result<Self, VolumeError> {
        let name = match code {
            0 => return Ok(Self::BloscLz),
            1 => return Ok(Self::Lz4),
            2 => "snappy",
            3 => return Ok(Self::Zlib),
            4 => "zstd",
            _ => "an unknown codec",
        };
        Err(VolumeError::Unsupported {
            found: format!("Blosc with {name} (code {code})"),
            accepted: "blosclz, lz4, zlib",
        })
    }

    /// Whether `stream` holds exactly `out.len()` bytes, which then stand in `out`.
    fn decompress(self, stream: &[u8], out: &mut [u8]) -> bool {
        match self {
            Self::BloscLz => blosclz(stream, out).is_some(),
            Self::Lz4 => lz4_flex::block::decompress_into(stream, out).is_ok_and(|count| count == out.len()),
            Self::Zlib => zlib(stream, out),
        }
    }
}

/// Whether `stream` holds exactly `out.len()` bytes, which then stand in `out`.
pub(in crate::volume) fn zlib(stream: &[u8], out: &mut [u8]) -> bool {
    let mut decoder = flate2::bufread::ZlibDecoder::new(stream);
    decoder.read_exact(out).is_ok() && matches!(decoder.read(&mut [0]), Ok(0))
}

/// Decompresses BloscLZ, an LZ77 of whole bytes: an instruction below 32 copies that many bytes and one from the
/// stream; any other repeats bytes of the output, its upper three bits the length, its lower five and the next byte the
/// distance.
fn blosclz(stream: &[u8], out: &mut [u8]) -> Option<()> {
    /// The largest distance of a short match less one; a long match counts from there.
    const FAR: usize = 8191;

    let mut input = stream.iter().copied().map(usize::from);
    let mut at = 0;
    // The upper bits of the first byte are free for the encoder's own use.
    let mut next = Some(input.next()? & 31);
    while let Some(code) = next {
        if code < 32 {
            let target = out.get_mut(at..at + code + 1)?;
            for byte in target {
                *byte = input.next()? as u8;
            }
            at += code + 1;
        } else {
            let mut length = (code >> 5) + 2;
            if code >> 5 == 7 {
                loop {
                    let more = input.next()?;
                    length = length.saturating_add(more);
                    if more < 255 {
                        break;
                    }
                }
            }
            let mut distance = (code & 31) << 8 | input.next()?;
            if distance == FAR {
                distance += input.next()? << 8 | input.next()?;
            }
            let from = at.checked_sub(distance + 1)?;
            if length > out.len() - at {
                return None;
            }
            // Source and target may overlap, and then the copy repeats itself: byte by byte.
            for i in 0..length {
                out[at + i] = out[from + i];
            }
            at += length;
        }
        next = input.next();
    }
    (at == out.len()).then_some(())
}

fn corrupt(what: impl std::fmt::Display) -> VolumeError {
    VolumeError::corrupt(format!("a Blosc chunk {what}"))
}
