#include "obj_document.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include <vrpipe/component/error.h>

#include "../ply_header.h"
#include "words.h"

namespace vrpipe {
namespace {

constexpr std::size_t kMaxObjCorners = 1024;
constexpr std::size_t kMaxMaterialNameBytes = 200;

/// Calls `use(words, line)` for every statement; a backslash at the end of a line joins it with the next.
template <class Use>
void for_each_statement(const std::string& text, const Use& use) {
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  std::string statement;
  for (std::size_t begin = text.compare(0, 3, kByteOrderMark) == 0 ? 3 : 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::string_view line = std::string_view(text).substr(begin, end - begin);
    begin = end + 1;
    line = line.substr(0, line.find('#'));
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    const bool goes_on = !line.empty() && line.back() == '\\';
    if (goes_on) line.remove_suffix(1);
    statement += line;
    if (goes_on) {
      statement += ' ';
      continue;
    }
    const std::vector<std::string_view> words = words_of(statement);
    if (!words.empty()) use(words, statement);
    statement.clear();
  }
}

/// The rest of a statement, which is a name with blanks perhaps; empty for one that is too long or not printable.
std::string name_in(std::string_view statement, std::string_view keyword) {
  std::string_view name = statement.substr(statement.find(keyword) + keyword.size());
  const std::size_t begin = name.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return {};
  name = name.substr(begin, name.find_last_not_of(" \t\r") - begin + 1);
  for (const char c : name) {
    if (static_cast<unsigned char>(c) < ' ') return {};
  }
  return name.size() > kMaxMaterialNameBytes ? std::string{} : std::string(name);
}

/// A corner of a face: indices as in the file, from 1, or below 0 from the latest on; 0: none.
struct Corner {
  std::int64_t position = 0, normal = 0;
};

std::optional<Corner> corner_of(std::string_view word) {
  std::array<std::int64_t, 3> indices{};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t slash = word.find('/');
    const std::string_view part = word.substr(0, slash);
    if (!part.empty()) {
      const std::optional<std::int64_t> index = number_of<std::int64_t>(part);
      if (!index || *index == 0) return {};
      indices[i] = *index;
    }
    if (slash == std::string_view::npos)
      return indices[0] == 0 ? std::nullopt : std::optional(Corner{indices[0], indices[2]});
    word.remove_prefix(slash + 1);
  }
  return {};  // three slashes
}

/// Counts what a statement may refer to, and copies it.
class ObjReducer {
 public:
  ObjReducer(const std::string& where, RejectedTriangles& rejected) : where_(where), rejected_(rejected) {}

  std::string reduce(const std::string& text) {
    for_each_statement(text, [&](const auto& words, const auto&) { count(words); });
    for_each_statement(text, [&](const auto& words, const std::string& statement) { copy(words, statement); });
    return has_faces_ ? std::move(result_) : std::string{};
  }

 private:
  using Words = std::vector<std::string_view>;

  [[noreturn]] void fail(const Words& words) const {
    throw UserError("cannot read mesh", where_,
                    fmt::format("`{} {}` is malformed", shortened(words[0]),
                                words.size() > 1 ? shortened(words[1]) : ""),
                    "export the mesh again");
  }

  void count(const Words& words) {
    if (words[0] == "v") ++all_positions_;
    if (words[0] == "vn") ++all_normals_;
    if (words[0] == "f") {
      for (std::size_t i = 1; i < words.size(); ++i) {
        const std::optional<Corner> corner = corner_of(words[i]);
        if (!corner) fail(words);
        has_normals_ = has_normals_ && corner->normal != 0;
      }
    }
  }

  void copy(const Words& words, const std::string& statement) {
    if (words[0] == "v") {
      ++positions_;
      // With w, or with a colour; what follows is no part of the format.
      numbers(words, words.size() >= 7 ? 6 : words.size() == 5 ? 4 : 3);
    } else if (words[0] == "vn") {
      ++normals_;
      if (has_normals_) numbers(words, 3);
    } else if (words[0] == "f") {
      face(words);
    } else if (words[0] == "l" || words[0] == "p") {
      ++rejected_.lines_and_points;
    } else if (words[0] == "usemtl" || words[0] == "mtllib") {
      const std::string name = name_in(statement, words[0]);
      if (!name.empty()) result_ += fmt::format("{} {}\n", words[0], name);
    }
  }

  void numbers(const Words& words, std::size_t how_many) {
    if (words.size() <= how_many) fail(words);
    result_ += words[0];
    for (std::size_t i = 1; i <= how_many; ++i) {
      const std::optional<float> number = float_of(words[i]);
      if (!number) fail(words);
      result_ += fmt::format(" {}", *number);
    }
    result_ += '\n';
  }

  /// From 1; 0 for one that names nothing.
  static std::int64_t absolute(std::int64_t index, std::int64_t so_far, std::int64_t all) {
    if (index < 0) return index < -so_far ? 0 : so_far + index + 1;
    return index > all ? 0 : index;
  }

  void face(const Words& words) {
    const std::size_t corners = words.size() - 1;
    if (corners < 3) {
      ++rejected_.lines_and_points;
      return;
    }
    if (corners > kMaxObjCorners) {
      throw UserError("cannot read mesh", where_, fmt::format("a face has {} corners", corners),
                      fmt::format("triangulate faces of more than {}", kMaxObjCorners));
    }
    std::string line = "f";
    for (std::size_t i = 1; i <= corners; ++i) {
      const Corner corner = *corner_of(words[i]);
      const std::int64_t position = absolute(corner.position, positions_, all_positions_);
      const std::int64_t normal = has_normals_ ? absolute(corner.normal, normals_, all_normals_) : 1;
      if (position == 0 || normal == 0) {
        rejected_.index_out_of_range += corners - 2;
        return;
      }
      line += has_normals_ ? fmt::format(" {}//{}", position, normal) : fmt::format(" {}", position);
    }
    has_faces_ = true;
    result_ += line + '\n';
  }

  const std::string& where_;
  RejectedTriangles& rejected_;
  std::int64_t all_positions_ = 0, all_normals_ = 0, positions_ = 0, normals_ = 0;
  bool has_normals_ = true, has_faces_ = false;
  std::string result_;
};

}  // namespace

std::string reduced_obj(const std::string& text, const std::string& where, RejectedTriangles& rejected) {
  return ObjReducer(where, rejected).reduce(text);
}

std::string reduced_mtl(const std::string& text) {
  std::string result;
  bool named = false;
  for_each_statement(text, [&](const std::vector<std::string_view>& words, const std::string& statement) {
    if (words[0] == "newmtl") {
      const std::string name = name_in(statement, words[0]);
      named = !name.empty();
      if (named) result += "newmtl " + name + '\n';
    }
    if (words[0] != "Kd" || !named || words.size() != 4) return;
    const auto red = float_of(words[1]), green = float_of(words[2]), blue = float_of(words[3]);
    if (red && green && blue) result += fmt::format("Kd {} {} {}\n", *red, *green, *blue);
  });
  return result;
}

}  // namespace vrpipe
