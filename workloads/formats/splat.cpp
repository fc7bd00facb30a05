// antimatter15's .splat: no header, 32 bytes a Gaussian, no spherical harmonics beyond degree 0.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <vrpipe/workloads/portable_math.h>
#include <vrpipe/workloads/preprocess.h>

#include "file_io.h"
#include "formats/attribute_codes.h"
#include "formats/scene_format.h"

namespace vrpipe {
namespace {

// Position and scale: 3 float32 each; red, green, blue and opacity, then w, x, y, z of the rotation: a byte each.
constexpr std::uint64_t kRecordBytes = 32;
constexpr std::size_t kScale = 12, kColour = 24, kOpacity = 27, kRotation = 28;

Match matches_splat(const SceneFile& file) { return file.ends_with(".splat") ? Match::by_name : Match::no; }

GaussianFile read_splat(const SceneFile& file) {
  const FileBytes& bytes = file.bytes;
  const std::uint64_t count = bytes.size() / kRecordBytes;
  if (bytes.size() % kRecordBytes != 0) {
    bytes.fail_at(count * kRecordBytes,
                  "its last record begins and has " + std::to_string(bytes.size() % kRecordBytes) + " of 32 bytes",
                  "get the file again, it seems cut short");
  }
  const std::array<float, 256>& logits = logits_of_bytes();
  GaussianFile result;
  result.gaussians = decode_gaussians(count, 0, bytes.where(), [&](std::uint64_t index, GaussianAttributes& gaussian) {
    const std::byte* const record = bytes.data() + index * kRecordBytes;
    const auto code = [record](std::size_t offset) { return std::to_integer<unsigned>(record[offset]); };
    std::array<double, 4> q{};
    for (std::size_t i = 0; i < 4; ++i) q[i] = (static_cast<double>(code(kRotation + i)) - 128) / 128;
    const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    // Of length 0 it stays, and is rejected as everywhere.
    for (std::size_t i = 0; i < 4; ++i) gaussian.rotation[i] = static_cast<float>(length > 0 ? q[i] / length : 0);
    for (std::size_t i = 0; i < 3; ++i) {
      gaussian.position[i] = load<float>(record + 4 * i);
      gaussian.log_scale[i] = log_scale_of(load<float>(record + kScale + 4 * i));
      gaussian.f_dc[i] = f_dc_of_colour(code(kColour + i) / 255.0);
    }
    gaussian.opacity_logit = logits[code(kOpacity)];
  });
  return result;
}

/// The nearest byte; 0 for what is not a number.
std::byte to_byte(double value) {
  const double limited = value > 0 ? std::min(value, 255.0) : 0.0;
  return static_cast<std::byte>(static_cast<unsigned>(limited + 0.5));
}

std::vector<std::string> write_splat(const std::filesystem::path& path, const GaussianFile& of) {
  const GaussianScene& scene = of.gaussians;
  AtomicFile file(path, "cannot write scene", path.string());
  for (std::uint64_t index = 0; index < scene.size(); ++index) {
    const GaussianRef gaussian = scene[index];
    std::array<std::byte, kRecordBytes> record{};
    const std::array<float, 3> position = scene.world_position(gaussian), log_scale = gaussian.log_scale(),
                               f_dc = gaussian.f_dc();
    for (std::size_t i = 0; i < 3; ++i) {
      const float scale = static_cast<float>(portable_exp(log_scale[i]));
      std::memcpy(&record[4 * i], &position[i], sizeof(float));
      std::memcpy(&record[kScale + 4 * i], &scale, sizeof scale);
      record[kColour + i] = to_byte(255 * (0.5 + kShBand0 * f_dc[i]));
    }
    record[kOpacity] = to_byte(255 * sigmoid(gaussian.opacity_logit()));
    const std::array<float, 4> rotation = gaussian.rotation();
    double squares = 0;
    for (const float component : rotation) squares += static_cast<double>(component) * component;
    for (std::size_t i = 0; i < 4; ++i) {
      record[kRotation + i] = to_byte(128 + (squares > 0 ? 128 * rotation[i] / std::sqrt(squares) : 0));
    }
    file.write(record.data(), record.size());
  }
  file.commit();
  std::vector<std::string> left_out;
  if (scene.sh_degree() > 0) {
    left_out.push_back("spherical harmonics of degree 1" +
                       (scene.sh_degree() > 1 ? " to " + std::to_string(scene.sh_degree()) : std::string()) +
                       " are left out: a .splat has none");
  }
  if (scene.compensates_opacity()) {
    left_out.push_back(
        "that it was trained anti-aliased is left out: draw it with --set preprocess.opacity_compensation=on");
  }
  if (of.up != GaussianFile().up) {
    left_out.push_back(
        fmt::format("where up is in it, {},{},{}, is left out: give it as --up", of.up.x, of.up.y, of.up.z));
  }
  return left_out;
}

const SceneFormatRegistrar splat_registrar({"antimatter15 .splat",
                                            "FILE.splat",
                                            "32 bytes a Gaussian, colours and rotations in bytes, no SH",
                                            {},
                                            matches_splat,
                                            read_splat,
                                            write_splat,
                                            ".splat"});

}  // namespace
}  // namespace vrpipe
