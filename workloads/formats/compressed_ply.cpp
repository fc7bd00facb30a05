// PlayCanvas' compressed .ply: chunks of 256 vertices with the ranges in which positions, scales and, in newer files, colours
// are quantised; four words a vertex; perhaps an element `sh` of bytes.
#include <algorithm>
#include <string>
#include <string_view>

#include "formats/attribute_codes.h"
#include "formats/ply_comments.h"
#include "formats/ply_records.h"
#include "formats/scene_format.h"

namespace vrpipe {
namespace {

constexpr std::uint64_t kChunkVertices = 256;
constexpr double kSqrt2 = 1.41421356237309504880;

Match matches_compressed_ply(const SceneFile& file) {
  if (!file.bytes.begins_with("ply\n") && !file.bytes.begins_with("ply\r\n")) return Match::no;
  const std::string_view head(reinterpret_cast<const char*>(file.bytes.data()),
                              static_cast<std::size_t>(std::min<std::uint64_t>(file.bytes.size(), kMaxPlyHeaderBytes)));
  const std::string_view header = head.substr(0, head.find("end_header"));
  return header.find("packed_position") == std::string_view::npos ? Match::no : Match::by_content;
}

/// Where the two ends of a quantised range lie in a chunk's record, for three components.
struct RangeLayout {
  std::array<std::uint32_t, 3> low{}, high{};

  static RangeLayout of(const PlyRecords& chunks, const std::string& prefix, const std::array<const char*, 3>& axes) {
    RangeLayout layout;
    for (std::size_t i = 0; i < 3; ++i) {
      layout.low[i] = chunks.offset("min_" + prefix + axes[i], "float");
      layout.high[i] = chunks.offset("max_" + prefix + axes[i], "float");
    }
    return layout;
  }
  /// Component `i` at `share` of the range, 0 to 1.
  double at(const std::byte* chunk, std::size_t i, double share) const {
    return between(load<float>(chunk + low[i]), load<float>(chunk + high[i]), share);
  }
};

double unorm(std::uint32_t word, unsigned shift, unsigned bits) {
  const std::uint32_t most = (1U << bits) - 1;
  return static_cast<double>((word >> shift) & most) / most;
}

/// 11, 10 and 11 bits from the top.
std::array<double, 3> unpack_11_10_11(std::uint32_t word) {
  return {unorm(word, 21, 11), unorm(word, 11, 10), unorm(word, 0, 11)};
}

/// Bytes of f_rest in [-4, 4]; the outermost codes are the ends, the others lie in the middle of their steps.
const std::array<float, 256>& rest_codes() {
  static const std::array<float, 256> codes = [] {
    std::array<float, 256> table{};
    for (std::size_t byte = 0; byte < table.size(); ++byte) {
      const double share = byte == 0 ? 0 : byte == 255 ? 1 : (static_cast<double>(byte) + 0.5) / 256;
      table[byte] = static_cast<float>((share - 0.5) * 8);
    }
    return table;
  }();
  return codes;
}

GaussianFile read_compressed_ply(const SceneFile& file) {
  const FileBytes& bytes = file.bytes;
  const PlyHeader header = read_gaussian_ply_header(bytes);
  const PlyRecords chunks(bytes, header, "chunk");
  const PlyRecords vertices(bytes, header, "vertex");
  const RangeLayout positions = RangeLayout::of(chunks, "", {"x", "y", "z"});
  const RangeLayout scales = RangeLayout::of(chunks, "scale_", {"x", "y", "z"});
  const bool has_colour_range = chunks.has("min_r");
  const RangeLayout colours = has_colour_range ? RangeLayout::of(chunks, "", {"r", "g", "b"}) : RangeLayout();
  const std::uint32_t position_word = vertices.offset("packed_position", "uint");
  const std::uint32_t rotation_word = vertices.offset("packed_rotation", "uint");
  const std::uint32_t scale_word = vertices.offset("packed_scale", "uint");
  const std::uint32_t colour_word = vertices.offset("packed_color", "uint");
  const std::uint64_t count = vertices.count();
  const std::uint64_t chunks_needed = count / kChunkVertices + (count % kChunkVertices != 0);
  if (chunks.count() < chunks_needed) {
    bytes.fail("its " + std::to_string(count) + " vertices need " + std::to_string(chunks_needed) +
                   " chunks of 256, and it announces " + std::to_string(chunks.count()),
               "export the scene again");
  }

  int sh_degree = 0;
  std::array<std::uint32_t, 45> rest_offsets{};
  const std::byte* rest_records = nullptr;
  std::uint64_t rest_stride = 0;
  if (header.element("sh") != nullptr) {
    const PlyRecords rest(bytes, header, "sh");
    sh_degree = sh_degree_of_ply(rest.rest_count(), "sh", bytes);
    if (sh_degree > 3) bytes.fail("its SH degree is " + std::to_string(sh_degree), "export it with 3 or fewer");
    for (std::size_t i = 0; i < rest.rest_count(); ++i)
      rest_offsets[i] = rest.offset("f_rest_" + std::to_string(i), "uchar");
    if (rest.count() < count) {
      bytes.fail("element sh has " + std::to_string(rest.count()) + " records for " + std::to_string(count) +
                     " vertices",
                 "export the scene again");
    }
    rest_records = rest.data();
    rest_stride = rest.stride();
  }
  const std::size_t per_channel = kShRestPerChannel[static_cast<std::size_t>(sh_degree)];
  const std::array<float, 256>& rest_values = rest_codes();
  const std::array<float, 256>& logits = logits_of_bytes();

  GaussianFile result;
  result.gaussians =
      decode_gaussians(count, sh_degree, bytes.where(), [&](std::uint64_t index, GaussianAttributes& gaussian) {
        const std::byte* const chunk = chunks[index / kChunkVertices];
        const std::byte* const vertex = vertices[index];
        const std::array<double, 3> position = unpack_11_10_11(load<std::uint32_t>(vertex + position_word));
        const std::array<double, 3> scale = unpack_11_10_11(load<std::uint32_t>(vertex + scale_word));
        const std::uint32_t rotation = load<std::uint32_t>(vertex + rotation_word);
        const std::uint32_t colour = load<std::uint32_t>(vertex + colour_word);
        for (std::size_t i = 0; i < 3; ++i) {
          gaussian.position[i] = static_cast<float>(positions.at(chunk, i, position[i]));
          gaussian.log_scale[i] = static_cast<float>(scales.at(chunk, i, scale[i]));
          const double share = unorm(colour, static_cast<unsigned>(24 - 8 * i), 8);
          gaussian.f_dc[i] = f_dc_of_colour(has_colour_range ? colours.at(chunk, i, share) : share);
        }
        const auto component = [&](unsigned shift) { return (unorm(rotation, shift, 10) - 0.5) * kSqrt2; };
        gaussian.rotation = quaternion_without(rotation >> 30U, component(20), component(10), component(0));
        gaussian.opacity_logit = logits[colour & 0xffU];
        for (std::size_t channel = 0; channel < 3; ++channel) {
          for (std::size_t c = 0; c < per_channel; ++c) {
            const std::byte* const code = rest_records + index * rest_stride + rest_offsets[channel * per_channel + c];
            gaussian.f_rest[channel][c] = rest_values[std::to_integer<std::size_t>(*code)];
          }
        }
      });
  apply_ply_comments(header, result);
  return result;
}

const SceneFormatRegistrar compressed_ply_registrar({"PlayCanvas compressed .ply",
                                                     "FILE.compressed.ply",
                                                     "16 bytes a Gaussian in chunks of 256, with or without SH",
                                                     {},
                                                     matches_compressed_ply,
                                                     read_compressed_ply});

}  // namespace
}  // namespace vrpipe
