// Niantic's .spz: versions 1 to 3 in one gzip stream (or bare), version 4 with a Zstandard stream for each attribute. Its world
// has x right, y up, z back unless an extension says otherwise. https://github.com/nianticlabs/spz
#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>

#include <fmt/format.h>

#include <vrpipe/arithmetic/half.h>

#include "formats/attribute_codes.h"
#include "formats/scene_format.h"
#include "formats/turn.h"
#include "formats/unpack.h"

namespace vrpipe {
namespace {

constexpr std::uint64_t kSpzHeaderBytes = 16;
constexpr std::uint64_t kHeaderBytesV4 = 32;
constexpr unsigned kAntiAliased = 1, kHasExtensions = 2;
constexpr char kGzipMagic[] = "\x1f\x8b";
constexpr char kSpzRemedy[] = "export the scene as .spz version 1 to 4";

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
  unsigned flags = 0;
  std::uint64_t rest_per_channel = 0;  ///< coefficients that the file holds

  std::uint64_t coordinate_bytes() const { return version == 1 ? 2 : 3; }
  std::uint64_t rotation_bytes() const { return version <= 2 ? 3 : 4; }
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
  header.flags = bytes.number<std::uint8_t>(14, what);
  if (header.version < 1 || header.version > 4) {
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
  return {3 * header.coordinate_bytes(), 1, 3, 3, header.rotation_bytes(), 3 * header.rest_per_channel};
}

/// Versions 1 to 3: one block behind the other.
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

struct Extensions {
  std::optional<std::string> axes;
  std::vector<std::string> notes;
};

/// Records between two places: what they are, the bytes that follow, and these.
Extensions read_extensions(const FileBytes& bytes, std::uint64_t from, std::uint64_t to) {
  constexpr std::uint32_t kSafeOrbit = 0xadbe0002, kAxes = 0xadbe0003;
  Extensions extensions;
  std::set<std::uint32_t> unused;
  const std::string what = "an extension";
  while (from < to && to - from >= 8) {
    const auto kind = bytes.number<std::uint32_t>(from, what);
    const std::uint64_t length = bytes.number<std::uint32_t>(from + 4, what);
    if (length > to - from - 8) bytes.fail_at(from + 4, "an extension of it goes beyond them", kSpzRemedy);
    if (kind == kAxes && length >= 4) {
      const auto code = bytes.number<std::uint32_t>(from + 8, what);
      if (code > AxesTurn::names().size())
        bytes.fail_at(from + 8, "its axes have the code " + std::to_string(code),
                      "codes 0 to 16 are known; give #axes=rub");
      if (code > 0) extensions.axes = AxesTurn::names()[code - 1];
    } else {
      unused.insert(kind);
    }
    from += 8 + length;
  }
  for (const std::uint32_t kind : unused) {
    constexpr std::size_t kMost = 8;  // a file may hold millions
    if (extensions.notes.size() == kMost) break;
    const char* const name = kind == kSafeOrbit ? ", limits of an orbit," : "";
    extensions.notes.push_back(fmt::format("its extension 0x{:08x}{} is not used", kind, name));
  }
  return extensions;
}

/// Where x, y and z point: as is said behind the file's name, else in the file, else as the format has it.
std::string axes_of(const SceneFile& file, const Extensions& extensions) {
  const auto choice = file.choices.find("axes");
  if (choice == file.choices.end()) return extensions.axes.value_or("rub");
  const std::vector<std::string>& known = AxesTurn::names();
  if (std::find(known.begin(), known.end(), choice->second) != known.end()) return choice->second;
  file.bytes.fail("the axes are to be `" + choice->second + "`",
                  "give #axes=rub (x right, y up, z back, the format's own), #axes=rdf (x right, y down, z front), or "
                  "another of " +
                      fmt::format("{}", fmt::join(known, ", ")));
}

/// What lies behind the blocks of a file, and what its extensions say.
struct Contents {
  Header header;
  std::array<FileBytes, 6> blocks;
  Extensions extensions;
};

Contents read_contents(const FileBytes& bytes) {
  Contents contents;
  Header& header = contents.header;
  const auto blocks_end = [&] {
    std::uint64_t end = kSpzHeaderBytes;
    for (const std::uint64_t stride : block_strides(header)) end += header.count * stride;
    return end;
  };
  FileBytes unpacked = bytes;
  if (bytes.begins_with(kGzipMagic)) {
    GzipStream stream(bytes);
    stream.unpack(kSpzHeaderBytes);
    const FileBytes head = stream.first(kSpzHeaderBytes);
    if (head.begins_with("ply"))
      bytes.fail("it is a .ply in a gzip stream", "unpack it with gunzip, and give the .ply");
    header = read_header(head, bytes.size());
    if (header.version == 4) bytes.fail_at(0, "version 4 is in a gzip stream", kSpzRemedy);
    stream.unpack(blocks_end() - kSpzHeaderBytes);
    if ((header.flags & kHasExtensions) != 0) stream.unpack_rest();
    stream.finish();
    unpacked = stream.take();
  } else {
    header = read_header(bytes, bytes.size());
  }
  contents.blocks = header.version == 4 ? blocks_of_table(header, bytes) : blocks_of_stream(header, unpacked);
  if ((header.flags & kHasExtensions) == 0) return contents;
  contents.extensions = header.version == 4
                            ? read_extensions(bytes, kHeaderBytesV4, bytes.number<std::uint32_t>(16, "its header"))
                            : read_extensions(unpacked, blocks_end(), unpacked.size());
  return contents;
}

GaussianFile read_spz(const SceneFile& file) {
  const Contents contents = read_contents(file.bytes);
  const Header& header = contents.header;
  const auto& blocks = contents.blocks;
  const AxesTurn turn(axes_of(file, contents.extensions));
  GaussianFile result;
  result.notes = contents.extensions.notes;
  const int degree = std::min(static_cast<int>(header.sh_degree), 3);
  if (header.sh_degree > 3) result.notes.push_back("spherical harmonics of degree 4 are left out");
  if (const unsigned unknown = header.flags & ~(kAntiAliased | kHasExtensions); unknown != 0)
    result.notes.push_back(fmt::format("its flags 0x{:02x} are not understood, nor used", unknown));
  const std::size_t used = kShRestPerChannel[static_cast<std::size_t>(degree)];
  const std::uint64_t rest_stride = 3 * header.rest_per_channel;
  const double unit = 1.0 / static_cast<double>(std::uint32_t{1} << header.fraction_bits);
  const std::array<float, 256>& logits = logits_of_bytes();
  const std::uint64_t coordinate_bytes = header.coordinate_bytes();
  result.gaussians = decode_gaussians(
      header.count, degree, file.bytes.where(), [&](std::uint64_t index, GaussianAttributes& gaussian) {
        const std::byte* const position = blocks[0].data() + 3 * coordinate_bytes * index;
        const std::byte* const colour = blocks[2].data() + 3 * index;
        const std::byte* const scale = blocks[3].data() + 3 * index;
        for (std::size_t i = 0; i < 3; ++i) {
          const std::byte* const coordinate = position + coordinate_bytes * i;
          gaussian.position[i] = header.version == 1 ? half_value(load<std::uint16_t>(coordinate))
                                                     : static_cast<float>(signed_24_bits(coordinate) * unit);
          gaussian.f_dc[i] = static_cast<float>((std::to_integer<int>(colour[i]) / 255.0 - 0.5) / 0.15);
          gaussian.log_scale[i] = static_cast<float>(std::to_integer<int>(scale[i]) / 16.0 - 10);
        }
        gaussian.opacity_logit = logits[std::to_integer<std::size_t>(blocks[1].data()[index])];
        const std::byte* const rotation = blocks[4].data() + header.rotation_bytes() * index;
        gaussian.rotation =
            header.version <= 2 ? rotation_of_bytes(rotation) : rotation_of_word(load<std::uint32_t>(rotation));
        // Coefficient by coefficient, red, green and blue together.
        const std::byte* const rest = blocks[5].data() + rest_stride * index;
        for (std::size_t c = 0; c < used; ++c) {
          for (std::size_t channel = 0; channel < 3; ++channel) {
            gaussian.f_rest[channel][c] = static_cast<float>(std::to_integer<int>(rest[3 * c + channel]) - 128) / 128;
          }
        }
        turn.apply(gaussian, degree);
      });
  if ((header.flags & kAntiAliased) != 0) set_anti_aliased(result, "flag 1 of its header");
  return result;
}

const SceneFormatRegistrar spz_registrar(
    {"Niantic .spz",
     "FILE.spz",
     "20 bytes a Gaussian and up to 45 of SH, packed; versions 1 to 4",
     {{"axes",
       "where its x, y and z point, if not as the file or the format says (rub: right, up, back): rdf, luf, ..."}},
     matches_spz,
     read_spz});

}  // namespace
}  // namespace vrpipe
