#include "formats/ply_comments.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <locale>
#include <optional>
#include <sstream>
#include <string>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "formats/scene_format.h"

namespace vrpipe {
namespace {

/// What follows `key` and perhaps a colon, in lower case. None where the comment begins with something else.
std::optional<std::string> value_of(const std::string& comment, const std::string& key) {
  std::string text = comment;
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (text.rfind(key, 0) != 0) return std::nullopt;
  std::size_t from = key.size();
  if (from < text.size() && text[from] == ':') ++from;
  if (from < text.size() && text[from] != ' ' && text[from] != '\t' && from == key.size()) return std::nullopt;
  const std::size_t begin = text.find_first_not_of(" \t", from), end = text.find_last_not_of(" \t\r");
  return begin == std::string::npos ? std::string() : text.substr(begin, end + 1 - begin);
}

std::optional<Vec3> axis_of(const std::string& text) {
  if (text == "x") return Vec3{1, 0, 0};
  if (text == "y") return Vec3{0, 1, 0};
  if (text == "z") return Vec3{0, 0, 1};
  std::istringstream numbers(text);
  numbers.imbue(std::locale::classic());
  Vec3 up{};
  if (numbers >> up[0] >> up[1] >> up[2] && std::isfinite(glm::length(up)) && glm::length(up) > 0) return up;
  return std::nullopt;
}

}  // namespace

void apply_ply_comments(const PlyHeader& header, GaussianFile& file) {
  for (const std::string& comment : header.comments) {
    const auto is_unknown = [&] { file.notes.push_back("its comment `" + comment + "` is not understood, nor used"); };
    if (const auto axis = value_of(comment, "vertical axis")) {
      if (const auto up = axis_of(*axis)) {
        file.up = *up;
      } else {
        is_unknown();
      }
    }
    if (const auto mode = value_of(comment, "splatrendermode")) {
      if (*mode == "mip") {
        set_anti_aliased(file, comment);
      } else if (*mode != "default") {
        is_unknown();
      }
    }
    if (const auto flag = value_of(comment, "antialiased")) {
      if (*flag == "1" || *flag == "true") {
        set_anti_aliased(file, comment);
      } else if (*flag != "0" && *flag != "false") {
        is_unknown();
      }
    }
  }
}

std::string ply_comments_of(const GaussianFile& file) {
  std::string comments;
  if (file.up != GaussianFile().up)
    comments += fmt::format("comment Vertical axis: {} {} {}\n", file.up.x, file.up.y, file.up.z);
  if (file.gaussians.compensates_opacity()) comments += "comment SplatRenderMode: mip\n";
  return comments;
}

}  // namespace vrpipe
