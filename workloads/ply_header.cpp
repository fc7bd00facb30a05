#include "ply_header.h"

#include <algorithm>
#include <charconv>
#include <unordered_map>
#include <utility>

#include <vrpipe/component/error.h>

namespace vrpipe {
namespace {

class HeaderParser {
 public:
  HeaderParser(const std::string& what, const std::string& where, const std::string& export_remedy,
               std::string_view bytes)
      : what_(what), where_(where), export_remedy_(export_remedy), bytes_(bytes) {}

  PlyHeader parse() {
    if (bytes_.substr(0, 4) != "ply\n" && bytes_.substr(0, 5) != "ply\r\n") {
      fail("the file does not begin with a line `ply`", export_remedy_);
    }
    next_line();
    bool format_seen = false;
    for (;;) {
      const std::string_view line = next_line();
      const std::vector<std::string_view> words = split(line);
      if (words.size() > 1 && words[0] == "comment") {
        header_.comments.emplace_back(line.substr(static_cast<std::size_t>(words[1].data() - line.data())));
      }
      if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
      if (words[0] == "end_header") break;
      if (words[0] == "format") {
        set_format(words);
        format_seen = true;
      } else if (words[0] == "element") {
        add_element(words);
      } else if (words[0] == "property") {
        add_property(words);
      } else {
        fail("header line " + std::to_string(line_) + " begins with `" + shortened(words[0]) + "`",
             "a PLY header holds format, comment, obj_info, element and property lines");
      }
    }
    if (!format_seen) fail("the header has no format line", export_remedy_);
    header_.size_bytes = position_;
    return std::move(header_);
  }

 private:
  [[noreturn]] void fail(const std::string& why, const std::string& remedy) const {
    throw UserError(what_, where_, why, remedy);
  }

  std::string_view next_line() {
    const std::size_t end = bytes_.find('\n', position_);
    if (end == std::string_view::npos) {
      fail("the header has no `end_header` line in its first " + std::to_string(bytes_.size()) + " bytes",
           "get the file again, it seems cut short");
    }
    std::string_view line = bytes_.substr(position_, end - position_);
    position_ = end + 1;
    ++line_;
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    return line;
  }

  static std::vector<std::string_view> split(std::string_view line) {
    std::vector<std::string_view> words;
    constexpr std::string_view kBlank = " \t";
    for (;;) {
      const std::size_t begin = line.find_first_not_of(kBlank);
      if (begin == std::string_view::npos) return words;
      const std::size_t end = std::min(line.find_first_of(kBlank, begin), line.size());
      words.push_back(line.substr(begin, end - begin));
      line.remove_prefix(end);
    }
  }

  void set_format(const std::vector<std::string_view>& words) {
    header_.format.clear();
    for (std::size_t i = 1; i < words.size(); ++i) header_.format += (i > 1 ? " " : "") + shortened(words[i]);
  }

  void add_element(const std::vector<std::string_view>& words) {
    PlyElement element;
    if (words.size() == 3) {
      element.name = words[1];
      const char* end = words[2].data() + words[2].size();
      const auto result = std::from_chars(words[2].data(), end, element.count);
      if (result.ec == std::errc{} && result.ptr == end) {
        header_.elements.push_back(std::move(element));
        return;
      }
    }
    fail("header line " + std::to_string(line_) + " is not `element NAME COUNT` with a count of 0 to 2^64-1",
         export_remedy_);
  }

  void add_property(const std::vector<std::string_view>& words) {
    const std::string line = "header line " + std::to_string(line_);
    if (header_.elements.empty()) fail(line + " is a property before any element", export_remedy_);
    PlyElement& element = header_.elements.back();
    if (words.size() == 5 && words[1] == "list") {
      element.properties.push_back(
          {std::string(words[4]), std::string(words[3]), element.stride_bytes, std::string(words[2])});
      return;
    }
    if (words.size() != 3) fail(line + " is not `property TYPE NAME`", export_remedy_);
    const std::uint32_t size = ply_scalar_size(words[1]);
    if (size == 0) {
      fail("property `" + shortened(words[2]) + "` has the unknown type `" + shortened(words[1]) + "`",
           "PLY types are char uchar short ushort int uint float double, and int8 to float64");
    }
    element.properties.push_back({std::string(words[2]), std::string(words[1]), element.stride_bytes, {}});
    element.stride_bytes += size;
  }

  std::string what_, where_, export_remedy_;
  std::string_view bytes_;
  std::size_t position_ = 0;
  int line_ = 0;
  PlyHeader header_;
};

}  // namespace

const PlyProperty* PlyElement::first_list() const {
  const auto found = std::find_if(properties.begin(), properties.end(),
                                  [](const PlyProperty& property) { return property.is_list(); });
  return found == properties.end() ? nullptr : &*found;
}

const PlyElement* PlyHeader::element(std::string_view name) const {
  const auto found =
      std::find_if(elements.begin(), elements.end(), [&](const PlyElement& element) { return element.name == name; });
  return found == elements.end() ? nullptr : &*found;
}

PlyHeader read_ply_header(std::string_view head, const std::string& what, const std::string& where,
                          const std::string& export_remedy) {
  return HeaderParser(what, where, export_remedy, head.substr(0, kMaxPlyHeaderBytes)).parse();
}

std::uint32_t ply_scalar_size(std::string_view type) {
  static const std::unordered_map<std::string_view, std::uint32_t> sizes = {
      {"char", 1},  {"uchar", 1},  {"short", 2},   {"ushort", 2}, {"int", 4},   {"uint", 4},
      {"float", 4}, {"double", 8}, {"int8", 1},    {"uint8", 1},  {"int16", 2}, {"uint16", 2},
      {"int32", 4}, {"uint32", 4}, {"float32", 4}, {"float64", 8}};
  const auto found = sizes.find(type);
  return found == sizes.end() ? 0 : found->second;
}

std::string shortened(std::string_view word) {
  constexpr std::size_t longest = 40;
  return word.size() <= longest ? std::string(word) : std::string(word.substr(0, longest)) + "...";
}

}  // namespace vrpipe
