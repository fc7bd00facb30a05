// mkkellogg's .ksplat, version 0.1: sections of Gaussians in float32 (level 0), or with positions in buckets (levels 1 and 2).
// https://github.com/mkkellogg/GaussianSplats3D
#include <algorithm>
#include <string>
#include <vector>

#include <vrpipe/arithmetic/half.h>

#include "formats/attribute_codes.h"
#include "formats/scene_format.h"

namespace vrpipe {
namespace {

constexpr std::uint64_t kKsplatHeaderBytes = 4096, kSectionHeaderBytes = 1024;
constexpr char kKsplatRemedy[] = "export the scene as .ksplat version 0.1, or in another format";
constexpr char kHeader[] = "its header";

/// Bytes of a record's parts at compression levels 0, 1 and 2.
struct Level {
  std::uint64_t centre, scale, rotation, rest;  ///< of one component
  std::uint64_t record(std::uint64_t rest_count) const {
    return 3 * centre + 3 * scale + 4 * rotation + 4 + rest_count * rest;
  }
};
constexpr std::array<Level, 3> kLevels = {{{4, 4, 4, 4}, {2, 2, 2, 2}, {2, 2, 2, 1}}};

Match matches_ksplat(const SceneFile& file) {
  const FileBytes& bytes = file.bytes;
  if (bytes.size() >= kKsplatHeaderBytes && bytes.number<std::uint16_t>(0, kHeader) == 0x0100) {
    const std::uint64_t sections = bytes.number<std::uint32_t>(4, kHeader);
    const bool level = bytes.number<std::uint16_t>(20, kHeader) < kLevels.size();
    if (level && sections >= 1 && sections <= (bytes.size() - kKsplatHeaderBytes) / kSectionHeaderBytes)
      return Match::by_content;
  }
  return file.ends_with(".ksplat") ? Match::by_name : Match::no;
}

struct Section {
  std::uint64_t first = 0, count = 0;  ///< Gaussians
  std::uint64_t bucket_size = 0, full_buckets = 0;
  std::vector<std::uint64_t>
      partial_ends;  ///< Gaussians of the section before the end of each bucket behind the full ones
  double step = 0;   ///< world units a code of a position
  double range = 0;  ///< code of a bucket's centre
  unsigned sh_degree = 0;
  const std::byte* buckets = nullptr;  ///< centres, 3 float32 each
  const std::byte* records = nullptr;
  std::uint64_t stride = 0;

  std::uint64_t bucket_of(std::uint64_t index) const {
    if (index < full_buckets * bucket_size) return index / bucket_size;
    const auto end = std::upper_bound(partial_ends.begin(), partial_ends.end(), index);
    return full_buckets + static_cast<std::uint64_t>(end - partial_ends.begin());
  }
};

/// A number of level 0, or a half.
float number_at(const std::byte* from, std::uint64_t bytes) {
  return bytes == 4 ? load<float>(from) : half_value(load<std::uint16_t>(from));
}

Section read_section(const FileBytes& bytes, std::uint64_t header, std::uint64_t& offset, std::size_t level) {
  const std::string what = "a section's header";
  const auto word = [&](std::uint64_t at) { return bytes.number<std::uint32_t>(header + at, what); };
  Section section;
  section.count = word(0);
  const std::uint64_t room = word(4);
  section.bucket_size = word(8);
  const std::uint64_t buckets = word(12);
  const double block_size = bytes.number<float>(header + 16, what);
  const std::uint64_t bucket_bytes = bytes.number<std::uint16_t>(header + 20, what);
  const std::uint32_t quantum = word(24);
  section.full_buckets = word(32);
  const std::uint64_t partial = word(36);
  section.sh_degree = bytes.number<std::uint16_t>(header + 40, what);
  if (section.count > room) {
    bytes.fail_at(header,
                  "a section has " + std::to_string(section.count) + " Gaussians and room for " + std::to_string(room),
                  kKsplatRemedy);
  }
  if (section.sh_degree > 2) {
    bytes.fail_at(header + 40, "the SH degree is " + std::to_string(section.sh_degree), "the format has 0 to 2");
  }
  const std::uint64_t rest_count = 3 * std::uint64_t{kShRestPerChannel[section.sh_degree]};
  section.stride = kLevels[level].record(rest_count);
  section.range = quantum == 0 ? 32767 : quantum;
  section.step = block_size / 2 / section.range;

  const std::byte* const sizes = bytes.records(offset, partial, 4, "the sizes of a section's buckets");
  std::uint64_t end = section.full_buckets * section.bucket_size;
  for (std::uint64_t i = 0; i < partial; ++i) {
    end += load<std::uint32_t>(sizes + 4 * i);
    section.partial_ends.push_back(end);
  }
  offset += 4 * partial;
  section.buckets = bytes.records(offset, buckets, bucket_bytes, "the centres of a section's buckets");
  const std::uint64_t bucket_storage = buckets * bucket_bytes;
  if (level > 0) {
    constexpr std::uint64_t kCentreBytes = 12;
    if (bucket_bytes != kCentreBytes) {
      bytes.fail_at(header + 20, "a bucket has " + std::to_string(bucket_bytes) + " bytes", "they have 12");
    }
    if (section.full_buckets + partial > buckets || (section.count > 0 && end < section.count)) {
      bytes.fail_at(header,
                    "the section's buckets hold " + std::to_string(end) + " of its " + std::to_string(section.count) +
                        " Gaussians",
                    kKsplatRemedy);
    }
  }
  offset += bucket_storage;
  section.records = bytes.records(offset, section.count, section.stride, "the Gaussians of a section");
  // The section's room is there, but for the last one, which may end with its last Gaussian.
  const std::uint64_t storage = room * section.stride;
  offset += std::min(storage, bytes.size() - offset);
  return section;
}

GaussianFile read_ksplat(const SceneFile& file) {
  const FileBytes& bytes = file.bytes;
  bytes.range(0, kKsplatHeaderBytes, kHeader);
  const unsigned major = bytes.number<std::uint8_t>(0, kHeader), minor = bytes.number<std::uint8_t>(1, kHeader);
  if (major != 0 || minor < 1) {
    bytes.fail_at(0, "its version is " + std::to_string(major) + "." + std::to_string(minor), kKsplatRemedy);
  }
  // Not how many are loaded, at byte 8, which some programs leave at 0.
  const std::uint64_t count = bytes.number<std::uint32_t>(4, kHeader);
  const std::size_t level = bytes.number<std::uint16_t>(20, kHeader);
  if (level > 2) bytes.fail_at(20, "its compression level is " + std::to_string(level), "levels 0 to 2 are read");
  double rest_low = bytes.number<float>(36, kHeader), rest_high = bytes.number<float>(40, kHeader);
  if (rest_low == 0) rest_low = -1.5;
  if (rest_high == 0) rest_high = 1.5;

  bytes.records(kKsplatHeaderBytes, count, kSectionHeaderBytes, "the headers of its sections");
  std::uint64_t offset = kKsplatHeaderBytes + count * kSectionHeaderBytes, total = 0;
  std::vector<Section> sections;
  unsigned degree = 0;
  for (std::uint64_t i = 0; i < count; ++i) {
    Section section = read_section(bytes, kKsplatHeaderBytes + i * kSectionHeaderBytes, offset, level);
    section.first = total;
    total += section.count;
    degree = std::max(degree, section.sh_degree);
    if (section.count > 0) sections.push_back(std::move(section));
  }

  const Level layout = kLevels[level];
  const std::array<float, 256>& logits = logits_of_bytes();
  GaussianFile result;
  result.gaussians = decode_gaussians(
      total, static_cast<int>(degree), bytes.where(), [&](std::uint64_t index, GaussianAttributes& gaussian) {
        const Section& section = *(std::upper_bound(sections.begin(), sections.end(), index,
                                                    [](std::uint64_t i, const Section& s) { return i < s.first; }) -
                                   1);
        const std::uint64_t here = index - section.first;
        const std::byte* const centre = section.records + here * section.stride;
        const std::byte* const scale = centre + 3 * layout.centre;
        const std::byte* const rotation = scale + 3 * layout.scale;
        const std::byte* const colour = rotation + 4 * layout.rotation;
        const std::byte* const rest = colour + 4;
        const std::byte* const bucket = level == 0 ? nullptr : section.buckets + 12 * section.bucket_of(here);
        for (std::size_t i = 0; i < 3; ++i) {
          gaussian.position[i] =
              level == 0 ? load<float>(centre + 4 * i)
                         : static_cast<float>((load<std::uint16_t>(centre + 2 * i) - section.range) * section.step +
                                              load<float>(bucket + 4 * i));
          gaussian.log_scale[i] = log_scale_of(number_at(scale + layout.scale * i, layout.scale));
          gaussian.f_dc[i] = f_dc_of_colour(std::to_integer<int>(colour[i]) / 255.0);
        }
        for (std::size_t i = 0; i < 4; ++i)
          gaussian.rotation[i] = number_at(rotation + layout.rotation * i, layout.rotation);
        gaussian.opacity_logit = logits[std::to_integer<std::size_t>(colour[3])];
        // Band by band, and in each band all red ones, all green ones, all blue ones.
        const std::size_t used = kShRestPerChannel[section.sh_degree];
        std::size_t next = 0;
        for (std::size_t band = 1, first = 0; first < used; first += 2 * band + 1, ++band) {
          for (std::size_t channel = 0; channel < 3; ++channel) {
            for (std::size_t c = first; c < first + 2 * band + 1; ++c, ++next) {
              const std::byte* const code = rest + layout.rest * next;
              gaussian.f_rest[channel][c] =
                  layout.rest == 1
                      ? static_cast<float>(rest_low + (rest_high - rest_low) * (std::to_integer<int>(*code) / 255.0))
                      : number_at(code, layout.rest);
            }
          }
        }
      });
  return result;
}

const SceneFormatRegistrar ksplat_registrar({"mkkellogg .ksplat",
                                             "FILE.ksplat",
                                             "24 to 140 bytes a Gaussian, compression levels 0 to 2, SH degree 0 to 2",
                                             {},
                                             matches_ksplat,
                                             read_ksplat});

}  // namespace
}  // namespace vrpipe
