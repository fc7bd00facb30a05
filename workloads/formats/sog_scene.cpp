#include "formats/sog_scene.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include <vrpipe/workloads/gaussian_scene.h>
#include <vrpipe/workloads/portable_math.h>

#include "formats/attribute_codes.h"
#include "formats/unpack.h"
#include "formats/zip_archive.h"

namespace vrpipe {
namespace {

constexpr char kSogRemedy[] = "export the scene again";
/// Palette entries in a row of the image of centroids.
constexpr std::uint64_t kPaletteRow = 64;

/// Of an archive that is no SOG: what it is instead.
[[noreturn]] void fail_of_archive(const ZipArchive& archive, const FileBytes& file) {
  const auto ends_with = [](const std::string& name, const std::string& end) {
    return name.size() >= end.size() && name.compare(name.size() - end.size(), end.size(), end) == 0;
  };
  for (const std::string& name : archive.names()) {
    if (name == "document.json")
      file.fail("it is a project of SuperSplat", "open it there, and export the scene as .ply or .sog");
    if (ends_with(name, ".npy")) file.fail("it holds arrays of NumPy (.npz)", "write the Gaussians as INRIA's .ply");
  }
  for (const char* extension : {".ply", ".splat", ".spz", ".ksplat", ".sog", ".glb"}) {
    for (const std::string& name : archive.names()) {
      if (ends_with(name, extension))
        file.fail("it is a zip archive with `" + name.substr(0, 100) + "`", "unpack it, and give that file");
    }
  }
  file.fail("its zip archive has no meta.json, nor a scene in another format", "give a .sog, which has one");
}

/// The members of an archive beside its meta.json, wherever that lies in it.
std::string folder_of_meta(const ZipArchive& archive, const FileBytes& file) {
  const std::string meta = "meta.json";
  const std::string* best = nullptr;
  for (const std::string& name : archive.names()) {
    const bool ends = name == meta || (name.size() > meta.size() &&
                                       name.compare(name.size() - meta.size() - 1, std::string::npos, "/" + meta) == 0);
    if (ends && (best == nullptr || name.size() < best->size())) best = &name;
  }
  if (best == nullptr) fail_of_archive(archive, file);
  return best->substr(0, best->size() - meta.size());
}

std::uint64_t pixels_at_most(std::uint64_t needed) {
  // Images are filled up to whole rows, and to multiples of a few pixels.
  return 2 * needed + 65536;
}

}  // namespace

nlohmann::json parse_scene_json(const FileBytes& bytes) {
  const auto* const text = reinterpret_cast<const char*>(bytes.data());
  // In memory a character may become a value of 50 bytes. The tree of a streamed scene has a few bytes for each thousand Gaussians.
  constexpr std::uint64_t kMost = std::uint64_t{64} << 20U;
  if (bytes.size() > kMost)
    bytes.fail("its JSON has " + std::to_string(bytes.size()) + " bytes", "up to 64 MiB are read");
  try {
    return nlohmann::json::parse(text, text + bytes.size());
  } catch (const nlohmann::json::parse_error& error) {
    bytes.fail_at(error.byte, "it is no JSON", "get the file again");
  } catch (const nlohmann::json::exception&) {
    bytes.fail("it holds a number that is out of range", "get the file again");
  }
}

const nlohmann::json& json_member(const nlohmann::json& object, const std::string& name, const FileBytes& where) {
  if (!object.is_object()) where.fail("there is no object that has a `" + name + "`", kSogRemedy);
  const auto found = object.find(name);
  if (found == object.end()) where.fail("there is no `" + name + "`", kSogRemedy);
  return *found;
}

std::uint64_t json_count(const nlohmann::json& value, const std::string& name, const FileBytes& where) {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 53U;
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > kMost)
    where.fail("`" + name + "` is not a count", kSogRemedy);
  return value.get<std::uint64_t>();
}

std::string json_text(const nlohmann::json& value, const std::string& name, const FileBytes& where) {
  if (!value.is_string()) where.fail("`" + name + "` is not a text", kSogRemedy);
  return value.get<std::string>();
}

bool is_zip(const FileBytes& file) { return file.begins_with("PK\x03\x04"); }

SogScene::SogScene(const FileBytes& file, const Neighbour& neighbour)
    : where_(file), most_bytes_(is_zip(file) ? file.size() : std::numeric_limits<std::uint64_t>::max()) {
  if (!is_zip(file)) {
    read_attributes(parse_scene_json(file), neighbour);
    return;
  }
  const ZipArchive archive(file);
  const std::string folder = folder_of_meta(archive, file);
  where_ = archive.read(folder + "meta.json");
  read_attributes(parse_scene_json(where_), [&](const std::string& name) { return archive.read(folder + name); });
}

std::array<double, 4> SogScene::range_ends(const nlohmann::json& attribute, const std::string& name, const char* end,
                                           std::size_t count) const {
  const nlohmann::json& values = json_member(attribute, end, where_);
  const std::string what = name + "." + end;
  if (!values.is_array() || values.size() < count) {
    where_.fail("`" + what + "` is not an array of " + std::to_string(count) + " numbers", kSogRemedy);
  }
  std::array<double, 4> ends{};
  for (std::size_t i = 0; i < count; ++i) {
    if (!values[i].is_number()) where_.fail("`" + what + "` holds what is not a number", kSogRemedy);
    ends[i] = values[i].get<double>();
  }
  return ends;
}

SogScene::Codes SogScene::codebook(const nlohmann::json& attribute, const std::string& name) const {
  const nlohmann::json& values = json_member(attribute, "codebook", where_);
  Codes codes{};
  if (!values.is_array() || values.empty() || values.size() > codes.size()) {
    where_.fail("`" + name + ".codebook` is not an array of up to 256 numbers", kSogRemedy);
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!values[i].is_number()) where_.fail("`" + name + ".codebook` holds what is not a number", kSogRemedy);
    codes[i] = static_cast<float>(values[i].get<double>());
  }
  return codes;
}

SogScene::Codes SogScene::range_codes(double low, double high) const {
  Codes codes{};
  for (std::size_t i = 0; i < codes.size(); ++i) {
    codes[i] = static_cast<float>(between(low, high, static_cast<double>(i) / 255));
  }
  return codes;
}

FileBytes SogScene::image(const nlohmann::json& attribute, const std::string& name, std::size_t index,
                          const Neighbour& neighbour) {
  const nlohmann::json& files = json_member(attribute, "files", where_);
  if (!files.is_array() || files.size() <= index) where_.fail("`" + name + ".files` names too few files", kSogRemedy);
  const std::string file = json_text(files[index], name + ".files", where_);
  FileBytes bytes = neighbour(file);
  image_bytes_[file] = bytes.size();
  return bytes;
}

void SogScene::read_attributes(const nlohmann::json& meta, const Neighbour& neighbour) {
  const nlohmann::json& means = json_member(meta, "means", where_);
  const nlohmann::json& scales = json_member(meta, "scales", where_);
  const nlohmann::json& rotations = json_member(meta, "quats", where_);
  const nlohmann::json& colours = json_member(meta, "sh0", where_);
  version_ = 1;
  if (meta.contains("version")) {
    const std::uint64_t version = json_count(meta["version"], "version", where_);
    if (version != 2) where_.fail("its version is " + std::to_string(version), "versions 1 and 2 are read");
    version_ = 2;
  }
  if (version_ == 2) {
    count_ = json_count(json_member(meta, "count", where_), "count", where_);
  } else {
    const nlohmann::json& shape = json_member(means, "shape", where_);
    if (!shape.is_array() || shape.empty()) where_.fail("`means.shape` is not an array", kSogRemedy);
    count_ = json_count(shape[0], "means.shape", where_);
  }
  for (const char* name : {"antialias", "antialiased"}) {
    if (meta.contains(name) && meta[name] == true) anti_aliased_ = std::string(name) + ": true";
  }
  mean_low_ = range_ends(means, "means", "mins", 3);
  mean_high_ = range_ends(means, "means", "maxs", 3);
  if (version_ == 2) {
    scale_codes_.fill(codebook(scales, "scales"));
    colour_codes_.fill(codebook(colours, "sh0"));
    opacity_codes_ = logits_of_bytes();
  } else {
    const std::array<double, 4> scale_low = range_ends(scales, "scales", "mins", 3),
                                scale_high = range_ends(scales, "scales", "maxs", 3);
    const std::array<double, 4> colour_low = range_ends(colours, "sh0", "mins", 4),
                                colour_high = range_ends(colours, "sh0", "maxs", 4);
    for (std::size_t i = 0; i < 3; ++i) {
      scale_codes_[i] = range_codes(scale_low[i], scale_high[i]);
      colour_codes_[i] = range_codes(colour_low[i], colour_high[i]);
    }
    opacity_codes_ = range_codes(colour_low[3], colour_high[3]);
  }
  means_low_ = image(means, "means", 0, neighbour);
  means_high_ = image(means, "means", 1, neighbour);
  scales_ = image(scales, "scales", 0, neighbour);
  rotations_ = image(rotations, "quats", 0, neighbour);
  colours_ = image(colours, "sh0", 0, neighbour);
  if (meta.contains("shN") && !meta["shN"].is_null()) read_rest(meta["shN"], neighbour);
  std::uint64_t bytes = 0;
  for (const auto& file : image_bytes_) bytes += file.second;
  check_count(count_, std::min(bytes, most_bytes_), where_);
}

void SogScene::read_rest(const nlohmann::json& rest, const Neighbour& neighbour) {
  std::uint64_t coefficients = 0;
  if (version_ == 2) {
    const std::uint64_t bands = json_count(json_member(rest, "bands", where_), "shN.bands", where_);
    if (bands == 0) return;
    if (bands > 3) where_.fail("`shN.bands` is " + std::to_string(bands), "1 to 3 are read");
    coefficients = kShRestPerChannel[bands];
    palette_ = json_count(json_member(rest, "count", where_), "shN.count", where_);
    rest_codes_ = codebook(rest, "shN");
  } else {
    const auto end = [&](const char* name) {
      const nlohmann::json& value = json_member(rest, name, where_);
      if (!value.is_number()) where_.fail(std::string("`shN.") + name + "` is not a number", kSogRemedy);
      return value.get<double>();
    };
    rest_codes_ = range_codes(end("mins"), end("maxs"));
    const nlohmann::json& shape = json_member(rest, "shape", where_);
    if (!shape.is_array() || shape.size() < 2) where_.fail("`shN.shape` is not an array of 2 numbers", kSogRemedy);
    coefficients = json_count(shape[1], "shN.shape", where_) / 3;
  }
  sh_degree_ = sh_degree_of(coefficients);
  if (sh_degree_ < 1)
    where_.fail("`shN.shape` has " + std::to_string(coefficients) + " coefficients a channel", "3, 8 or 15 are read");
  constexpr std::uint64_t kMostEntries = 65536;
  if (palette_ > kMostEntries)
    where_.fail("`shN.count` is " + std::to_string(palette_), "a palette has up to 65536 entries");
  centroids_ = image(rest, "shN", 0, neighbour);
  labels_ = image(rest, "shN", 1, neighbour);
}

void SogScene::decode(const std::vector<Run>& runs, GaussianArray& gaussians) const {
  const std::uint64_t most = pixels_at_most(count_);
  const RgbaImage low = unpack_image(means_low_, count_, most), high = unpack_image(means_high_, count_, most);
  const RgbaImage scales = unpack_image(scales_, count_, most), rotations = unpack_image(rotations_, count_, most);
  const RgbaImage colours = unpack_image(colours_, count_, most);
  const std::size_t coefficients = kShRestPerChannel[static_cast<std::size_t>(sh_degree_)];
  RgbaImage labels, centroids;
  std::uint64_t row = 0;
  const auto label_of = [&](std::uint64_t index) {
    const std::byte* const label = labels[index];
    return std::to_integer<std::uint64_t>(label[0]) | std::to_integer<std::uint64_t>(label[1]) << 8U;
  };
  if (coefficients > 0) {
    labels = unpack_image(labels_, count_, most);
    row = kPaletteRow * coefficients;
    constexpr std::uint64_t kMostRows = 65536 / kPaletteRow;
    centroids = unpack_image(centroids_, palette_ * coefficients, kMostRows * row);
    if (centroids.width != row) {
      centroids_.fail("its image is " + std::to_string(centroids.width) + " pixels wide, and " + std::to_string(row) +
                          " are expected",
                      kSogRemedy);
    }
    std::uint64_t entries = centroids.height * kPaletteRow;
    if (version_ == 2) entries = std::min(entries, palette_);
    for (std::uint64_t i = 0; i < count_; ++i) {
      if (label_of(i) < entries) continue;
      labels_.fail("Gaussian " + std::to_string(i) + " has palette entry " + std::to_string(label_of(i)) + " of " +
                       std::to_string(entries),
                   kSogRemedy);
    }
  }
  constexpr double kRootOfTwo = 1.41421356237309504880;
  for (const Run& run : runs) {
    decode_into(gaussians, run.to, run.count, [&](std::uint64_t offset, GaussianAttributes& gaussian) {
      const std::uint64_t index = run.from + offset;
      for (std::size_t i = 0; i < 3; ++i) {
        const auto code = [&](const RgbaImage& image) { return std::to_integer<unsigned>(image[index][i]); };
        const double share = (code(low) | code(high) << 8U) / 65535.0;
        const double folded = mean_low_[i] + (mean_high_[i] - mean_low_[i]) * share;
        const double position = portable_exp(std::fabs(folded)) - 1;
        gaussian.position[i] = static_cast<float>(folded < 0 ? -position : position);
        gaussian.log_scale[i] = scale_codes_[i][code(scales)];
        gaussian.f_dc[i] = colour_codes_[i][code(colours)];
      }
      gaussian.opacity_logit = opacity_codes_[std::to_integer<std::size_t>(colours[index][3])];
      const std::byte* const rotation = rotations[index];
      const unsigned omitted = std::to_integer<unsigned>(rotation[3]) - 252U;
      const auto component = [&](std::size_t i) {
        return (std::to_integer<int>(rotation[i]) / 255.0 * 2 - 1) / kRootOfTwo;
      };
      if (omitted < 4) gaussian.rotation = quaternion_without(omitted, component(0), component(1), component(2));
      if (coefficients == 0) return;
      const std::uint64_t label = label_of(index);
      const std::uint64_t first = label / kPaletteRow * row + label % kPaletteRow * coefficients;
      for (std::size_t c = 0; c < coefficients; ++c) {
        for (std::size_t channel = 0; channel < 3; ++channel) {
          gaussian.f_rest[channel][c] = rest_codes_[std::to_integer<std::size_t>(centroids[first + c][channel])];
        }
      }
    });
  }
}

}  // namespace vrpipe
