#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "formats/file_bytes.h"

namespace vrpipe {

class GaussianArray;

/// Another file of a scene, by name.
using Neighbour = std::function<FileBytes(const std::string& name)>;

/// The text of a file as JSON.
/// @throws UserError when it is none
nlohmann::json parse_scene_json(const FileBytes& bytes);

/// A member of a JSON object.
/// @throws UserError when it is not there
const nlohmann::json& json_member(const nlohmann::json& object, const std::string& name, const FileBytes& where);
/// A whole number of 0 to 2^53.
/// @throws UserError when it is none; `name` is for the message
std::uint64_t json_count(const nlohmann::json& value, const std::string& name, const FileBytes& where);
std::string json_text(const nlohmann::json& value, const std::string& name, const FileBytes& where);

/// A scene in PlayCanvas' SOG, version 1 or 2: what meta.json says, and the packed images, not decoded yet.
class SogScene {
 public:
  /// @param file       a meta.json, or a zip archive with one
  /// @param neighbour  the other files of a meta.json's folder
  /// @throws UserError when something is not as the format has it, or more Gaussians are announced than the files justify
  SogScene(const FileBytes& file, const Neighbour& neighbour);

  std::uint64_t count() const { return count_; }
  int sh_degree() const { return sh_degree_; }
  /// Where its meta.json says that it was trained anti-aliased; empty where it does not.
  const std::string& anti_aliased() const { return anti_aliased_; }

  /// `count` Gaussians from `from` on, to be set in an array from `to` on.
  struct Run {
    std::uint64_t from, count, to;
  };
  /// Decodes runs, all within count().
  /// @throws UserError when an image is damaged, or a Gaussian names a palette entry that is not there
  void decode(const std::vector<Run>& runs, GaussianArray& gaussians) const;

 private:
  /// What a byte of a channel stands for.
  using Codes = std::array<float, 256>;

  Codes codebook(const nlohmann::json& attribute, const std::string& name) const;
  Codes range_codes(double low, double high) const;
  std::array<double, 4> range_ends(const nlohmann::json& attribute, const std::string& name, const char* end,
                                   std::size_t count) const;
  FileBytes image(const nlohmann::json& attribute, const std::string& name, std::size_t index,
                  const Neighbour& neighbour);
  void read_attributes(const nlohmann::json& meta, const Neighbour& neighbour);
  void read_rest(const nlohmann::json& rest, const Neighbour& neighbour);

  FileBytes where_;
  std::uint64_t most_bytes_;                          ///< of all images, whatever they are unpacked to
  std::map<std::string, std::uint64_t> image_bytes_;  ///< by name
  int version_ = 0;
  std::uint64_t count_ = 0;
  int sh_degree_ = 0;
  std::string anti_aliased_;
  std::uint64_t palette_ = 0;  ///< entries of it
  std::array<double, 4> mean_low_{}, mean_high_{};
  std::array<Codes, 3> scale_codes_{}, colour_codes_{};
  Codes opacity_codes_{}, rest_codes_{};
  FileBytes means_low_, means_high_, scales_, rotations_, colours_, centroids_, labels_;
};

/// Whether a file is a zip archive.
bool is_zip(const FileBytes& file);

}  // namespace vrpipe
