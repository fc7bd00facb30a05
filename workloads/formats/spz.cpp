// Niantic's .spz: versions 2 and 3 in one gzip stream (or bare), version 4 with a Zstandard stream for each attribute. Its world
// has x right, y up, z back; ours is INRIA's, x right, y down, z forward. https://github.com/nianticlabs/spz
#include <cmath>
#include <string>

#include "formats/attribute_codes.h"
#include "formats/scene_format.h"
#include "formats/unpack.h"

namespace vrpipe {
namespace {

constexpr std::uint64_t kSpzHeaderBytes = 16;
constexpr std::uint64_t kHeaderBytesV4 = 32;
constexpr char kGzipMagic[] = "\x1f\x8b";
constexpr char kSpzRemedy[] = "export the scene as .spz version 2 to 4";

Match matches_spz(const SceneFile& file) {
  if (file.bytes.begins_with("NGSP")) return Match::by_content;
  if (file.bytes.begins_with(kGzipMagic)) return Match::by_container;
  return file.ends_with(".spz") ? Match::by_name : Match::no;
}

struct Header {
  std::uint32_t version = 0;
  std::uint64_t count = 0;
  unsigned sh_degree = 0;  ///< up to 4, of which 3 are used
  unsigned fraction_bits = 0;
  std::uint64_t rest_per_channel = 0;  ///< coefficients that the file holds

  std::uint64_t rotation_bytes() const { return version == 2 ? 3 : 4; }
};

Header read_header(const FileBytes& bytes, std::uint64_t file_bytes) {
  const std::string what = "its header";
  bytes.range(0, kSpzHeaderBytes, what);
  if (!bytes.begins_with("NGSP")) bytes.fail_at(0, "there is no `NGSP`, with which an .spz begins", kSpzRemedy);
  Header header;
  header.version = bytes.number<std::uint32_t>(4, what);
  header.count = bytes.number<std::uint32_t>(8, what);
  header.sh_degree = bytes.number<std::uint8_t>(12, what);
  header.fraction_bits = bytes.number<std::uint8_t>(13, what);
  if (header.version < 2 || header.version > 4) {
    bytes.fail_at(4, "its version is " + std::to_string(header.version), kSpzRemedy);
  }
  const unsigned most = header.version == 4 ? 4 : 3;
  if (header.sh_degree > most) {
    bytes.fail_at(12, "its SH degree is " + std::to_string(header.sh_degree),
                  "version " + std::to_string(header.version) + " has 0 to " + std::to_string(most));
  }
  if (header.fraction_bits > 23) {
    bytes.fail_at(13, "its positions have " + std::to_string(header.fraction_bits) + " fractional bits",
                  "they have 24 bits in all");
  }
  header.rest_per_channel = (header.sh_degree + 1) * (header.sh_degree + 1) - 1;
  check_count(header.count, file_bytes, bytes);
  return header;
}

constexpr std::array<const char*, 6> kBlockNames = {"its positions", "its opacities", "its colours",
                                                    "its scales",    "its rotations", "its spherical harmonics"};

std::array<std::uint64_t, 6> block_strides(const Header& header) {
  return {9, 1, 3, 3, header.rotation_bytes(), 3 * header.rest_per_channel};
}

/// Versions 2 and 3: one block behind the other.
std::array<FileBytes, 6> blocks_of_stream(const Header& header, const FileBytes& unpacked) {
  std::array<FileBytes, 6> blocks;
  const std::array<std::uint64_t, 6> strides = block_strides(header);
  std::uint64_t offset = kSpzHeaderBytes;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const std::byte* const first = unpacked.records(offset, header.count, strides[i], kBlockNames[i]);
    const std::uint64_t size = header.count * strides[i];
    blocks[i] = FileBytes(std::shared_ptr<const std::byte[]>(unpacked.storage(), first), size, unpacked.where());
    offset += size;
  }
  return blocks;
}

/// Version 4: a table of sizes, then a Zstandard frame for each block.
std::array<FileBytes, 6> blocks_of_table(const Header& header, const FileBytes& file) {
  const std::string what = "its header";
  file.range(0, kHeaderBytesV4, what);
  const std::uint64_t streams = file.number<std::uint8_t>(15, what);
  const std::uint64_t needed = header.sh_degree == 0 ? 5 : 6;
  if (streams < needed) {
    file.fail_at(15,
                 "it announces " + std::to_string(streams) + " streams, and " + std::to_string(needed) + " are needed",
                 kSpzRemedy);
  }
  const std::uint64_t table = file.number<std::uint32_t>(16, what);
  constexpr std::uint64_t kEntryBytes = 16;
  file.records(table, streams, kEntryBytes, "its table of streams");
  std::array<FileBytes, 6> blocks;
  const std::array<std::uint64_t, 6> strides = block_strides(header);
  std::uint64_t offset = table + streams * kEntryBytes;
  for (std::size_t i = 0; i < needed; ++i) {
    const std::uint64_t entry = table + i * kEntryBytes;
    const std::uint64_t packed = file.number<std::uint64_t>(entry, what),
                        unpacked = file.number<std::uint64_t>(entry + 8, what);
    if (unpacked != header.count * strides[i]) {
      file.fail_at(entry + 8,
                   std::string("the size of ") + kBlockNames[i] + " is " + std::to_string(unpacked) + " bytes, and " +
                       std::to_string(header.count * strides[i]) + " are needed",
                   kSpzRemedy);
    }
    blocks[i] = unpack_zstd(file, offset, packed, unpacked, kBlockNames[i]);
    offset += packed;
  }
  return blocks;
}

std::int32_t signed_24_bits(const std::byte* from) {
  const std::uint32_t word = std::to_integer<std::uint32_t>(from[0]) | std::to_integer<std::uint32_t>(from[1]) << 8U |
                             std::to_integer<std::uint32_t>(from[2]) << 16U;
  return static_cast<std::int32_t>(word << 8U) / 256;
}

/// Three bytes: x, y and z; w is what is left.
std::array<float, 4> rotation_of_bytes(const std::byte* from) {
  const auto component = [from](std::size_t i) { return std::to_integer<int>(from[i]) / 127.5 - 1; };
  return quaternion_without(0, component(0), component(1), component(2));
}

/// A word: the index of the largest component in the order x, y, z, w, and the others as 9 bits and a sign, the last one lowest.
std::array<float, 4> rotation_of_word(std::uint32_t word) {
  constexpr double kSqrtHalf = 0.70710678118654752440;
  const unsigned largest = word >> 30U;
  std::array<double, 4> xyzw{};
  for (unsigned i = 4; i-- > 0;) {
    if (i == largest) continue;
    const double magnitude = (word & 0x1ffU) / 511.0 * kSqrtHalf;
    xyzw[i] = (word & 0x200U) != 0 ? -magnitude : magnitude;
    word >>= 10U;
  }
  const double sum = xyzw[0] * xyzw[0] + xyzw[1] * xyzw[1] + xyzw[2] * xyzw[2] + xyzw[3] * xyzw[3];
  xyzw[largest] = std::sqrt(std::fmax(0.0, 1 - sum));
  return {static_cast<float>(xyzw[3]), static_cast<float>(xyzw[0]), static_cast<float>(xyzw[1]),
          static_cast<float>(xyzw[2])};
}

/// Half a turn around x, between y up, z back and y down, z forward: the signs of the real spherical harmonics 1 to 15.
constexpr std::array<float, 15> kTurnedRest = {-1, -1, 1, -1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, 1};

bool turned(const SceneFile& file) {
  const auto choice = file.choices.find("axes");
  if (choice == file.choices.end() || choice->second == "rub") return true;
  if (choice->second != "rdf") {
    file.bytes.fail("the axes are to be `" + choice->second + "`",
                    "give #axes=rub (y up, the format's own) or #axes=rdf (y down)");
  }
  return false;
}

GaussianFile read_spz(const SceneFile& file) {
  const bool turn = turned(file);
  FileBytes bytes = file.bytes;
  Header header;
  GaussianFile result;
  std::array<FileBytes, 6> blocks;
  if (bytes.begins_with(kGzipMagic)) {
    GzipStream stream(bytes);
    stream.unpack(kSpzHeaderBytes);
    header = read_header(stream.first(kSpzHeaderBytes), bytes.size());
    if (header.version == 4) bytes.fail_at(0, "version 4 is in a gzip stream", kSpzRemedy);
    std::uint64_t size = 0;
    for (const std::uint64_t stride : block_strides(header)) size += header.count * stride;
    stream.unpack(size);
    stream.finish();
    blocks = blocks_of_stream(header, stream.take());
  } else {
    header = read_header(bytes, bytes.size());
    blocks = header.version == 4 ? blocks_of_table(header, bytes) : blocks_of_stream(header, bytes);
  }
  int degree = static_cast<int>(header.sh_degree);
  if (degree > 3) {
    degree = 3;
    result.notes.push_back("spherical harmonics of degree 4 are left out");
  }
  const std::size_t used = kShRestPerChannel[static_cast<std::size_t>(degree)];
  const std::uint64_t rest_stride = 3 * header.rest_per_channel;
  const double unit = 1.0 / static_cast<double>(std::uint32_t{1} << header.fraction_bits);
  const std::array<float, 256>& logits = logits_of_bytes();
  const float sign = turn ? -1.0f : 1.0f;
  result.gaussians =
      decode_gaussians(header.count, degree, bytes.where(), [&](std::uint64_t index, GaussianAttributes& gaussian) {
        const std::byte* const position = blocks[0].data() + 9 * index;
        const std::byte* const colour = blocks[2].data() + 3 * index;
        const std::byte* const scale = blocks[3].data() + 3 * index;
        for (std::size_t i = 0; i < 3; ++i) {
          gaussian.position[i] = static_cast<float>(signed_24_bits(position + 3 * i) * unit);
          gaussian.f_dc[i] = static_cast<float>((std::to_integer<int>(colour[i]) / 255.0 - 0.5) / 0.15);
          gaussian.log_scale[i] = static_cast<float>(std::to_integer<int>(scale[i]) / 16.0 - 10);
        }
        gaussian.opacity_logit = logits[std::to_integer<std::size_t>(blocks[1].data()[index])];
        const std::byte* const rotation = blocks[4].data() + header.rotation_bytes() * index;
        gaussian.rotation =
            header.version == 2 ? rotation_of_bytes(rotation) : rotation_of_word(load<std::uint32_t>(rotation));
        gaussian.position[1] *= sign;
        gaussian.position[2] *= sign;
        gaussian.rotation[2] *= sign;
        gaussian.rotation[3] *= sign;
        // Coefficient by coefficient, red, green and blue together.
        const std::byte* const rest = blocks[5].data() + rest_stride * index;
        for (std::size_t c = 0; c < used; ++c) {
          for (std::size_t channel = 0; channel < 3; ++channel) {
            const float value = static_cast<float>(std::to_integer<int>(rest[3 * c + channel]) - 128) / 128;
            gaussian.f_rest[channel][c] = turn ? value * kTurnedRest[c] : value;
          }
        }
      });
  return result;
}

const SceneFormatRegistrar spz_registrar(
    {"Niantic .spz",
     "FILE.spz",
     "20 bytes a Gaussian and up to 45 of SH, packed; versions 2 to 4",
     {{"axes",
       "rub: the file's y points up, as the format has it (the default); rdf: it points down, as some programs write"}},
     matches_spz,
     read_spz});

}  // namespace
}  // namespace vrpipe
