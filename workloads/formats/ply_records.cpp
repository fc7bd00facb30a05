#include "formats/ply_records.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>
#include <vector>

#include "formats/attribute_codes.h"

namespace vrpipe {
namespace {

constexpr char kExportRemedy[] = "export the scene as an INRIA 3D Gaussian splatting .ply";
constexpr char kLittleEndian[] = "binary_little_endian 1.0";
constexpr char kBigEndian[] = "binary_big_endian 1.0";
constexpr char kAscii[] = "ascii 1.0";

bool same_type(std::string_view a, std::string_view b) {
  const auto plain = [](std::string_view type) {
    if (type == "float32") return std::string_view("float");
    if (type == "uint32") return std::string_view("uint");
    if (type == "uint8") return std::string_view("uchar");
    return type;
  };
  return plain(a) == plain(b);
}

PlyNumber::Type type_of(std::string_view type) {
  using Type = PlyNumber::Type;
  static const std::map<std::string_view, Type> types = {
      {"char", Type::int8},     {"int8", Type::int8},       {"uchar", Type::uint8},    {"uint8", Type::uint8},
      {"short", Type::int16},   {"int16", Type::int16},     {"ushort", Type::uint16},  {"uint16", Type::uint16},
      {"int", Type::int32},     {"int32", Type::int32},     {"uint", Type::uint32},    {"uint32", Type::uint32},
      {"float", Type::float32}, {"float32", Type::float32}, {"double", Type::float64}, {"float64", Type::float64}};
  return types.at(type);  // the header has no other
}

/// Calls `visit` with a value of the type.
template <class Visit>
auto with_type(PlyNumber::Type type, const Visit& visit) {
  using Type = PlyNumber::Type;
  switch (type) {
    case Type::int8: return visit(std::int8_t{});
    case Type::uint8: return visit(std::uint8_t{});
    case Type::int16: return visit(std::int16_t{});
    case Type::uint16: return visit(std::uint16_t{});
    case Type::int32: return visit(std::int32_t{});
    case Type::uint32: return visit(std::uint32_t{});
    case Type::float32: return visit(float{});
    default: return visit(double{});
  }
}

/// AsciiWords of an ascii file, from a byte on.
class AsciiWords {
 public:
  AsciiWords(const FileBytes& file, std::uint64_t from) : file_(file), at_(from), end_(from) {}
  std::uint64_t at() const { return at_; }
  /// The next one; `at` is then where it begins. Empty at the end.
  std::string_view next() {
    const char* const text = reinterpret_cast<const char*>(file_.data());
    while (end_ < file_.size() && is_blank(text[end_])) ++end_;
    at_ = end_;
    while (end_ < file_.size() && !is_blank(text[end_])) ++end_;
    return {text + at_, static_cast<std::size_t>(end_ - at_)};
  }

 private:
  static bool is_blank(char c) { return c == ' ' || c == '\n' || c == '\t' || c == '\r'; }
  const FileBytes& file_;
  std::uint64_t at_, end_;
};

/// False for what is no number of the type.
template <class Number>
bool parse(std::string_view word, Number& number) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  const char* const end = word.data() + word.size();
  const auto read = std::from_chars(word.data(), end, number);
  if (read.ec == std::errc() && read.ptr == end) return true;
  if constexpr (std::is_floating_point_v<Number>) {
    // Beyond the type's range: what is nearest to it.
    if (read.ec != std::errc::result_out_of_range || read.ptr != end) return false;
    const bool is_negative = word.front() == '-';
    const bool is_small = word.find("e-") != std::string_view::npos || word.find("E-") != std::string_view::npos;
    number = is_small ? Number{0} : std::numeric_limits<Number>::infinity();
    if (is_negative) number = -number;
    return true;
  } else {
    // Some programs write 255.0.
    double real = 0;
    const auto as_real = std::from_chars(word.data(), end, real);
    if (as_real.ec != std::errc() || as_real.ptr != end) return false;
    number = static_cast<Number>(0);
    if (!(real >= static_cast<double>(std::numeric_limits<Number>::min()) &&
          real <= static_cast<double>(std::numeric_limits<Number>::max())))
      return false;
    number = static_cast<Number>(real);
    return static_cast<double>(number) == real;
  }
}

void refuse_lists(const FileBytes& file, const PlyElement& element, const std::string& place,
                  const std::string& remedy) {
  if (const PlyProperty* list = element.first_list()) {
    file.fail("element " + shortened(element.name) + place + " has the list property `" + shortened(list->name) + "`",
              remedy);
  }
}

}  // namespace

PlyHeader read_gaussian_ply_header(const FileBytes& file) {
  const std::string_view head(reinterpret_cast<const char*>(file.data()), static_cast<std::size_t>(file.size()));
  PlyHeader header = read_ply_header(head, kCannotReadScene, file.where(), kExportRemedy);
  if (header.format != kLittleEndian && header.format != kBigEndian && header.format != kAscii) {
    file.fail("its format is `" + shortened(header.format) + "`",
              std::string("convert it to `") + kLittleEndian + "`, `" + kBigEndian + "` or `" + kAscii + "`");
  }
  return header;
}

PlyRecords::PlyRecords(const FileBytes& file, const PlyHeader& header, const std::string& name)
    : file_(file), element_(header.element(name)) {
  if (element_ == nullptr) file.fail("the header has no element " + name, kExportRemedy);
  const bool is_ascii = header.format == kAscii;
  std::uint64_t offset = header.size_bytes;
  for (const PlyElement* element = header.elements.data(); element != element_; ++element) {
    refuse_lists(file, *element, " before element " + name, "write element " + name + " first");
    if (is_ascii) continue;
    file.records(offset, element->count, element->stride_bytes, "element " + shortened(element->name));
    offset += element->count * element->stride_bytes;
  }
  refuse_lists(file, *element_, "", "a Gaussian has scalar properties only; remove the list");
  for (const PlyProperty& property : element_->properties) {
    if (!properties_.emplace(property.name, &property).second) {
      file.fail("property `" + shortened(property.name) + "` occurs twice in element " + name, kExportRemedy);
    }
  }
  bytes_ = file;
  if (is_ascii) {
    bytes_ = parsed(header);
    data_ = bytes_.data();
  } else {
    data_ = file.records(offset, count(), stride(), "element " + name);
  }
  if (header.format != kBigEndian) return;
  bytes_ = swapped(data_);
  data_ = bytes_.data();
}

FileBytes PlyRecords::swapped(const std::byte* records) const {
  const std::uint64_t size = count() * stride();
  const std::shared_ptr<std::byte[]> bytes = allocate_bytes(size, file_.where());
  std::copy_n(records, size, bytes.get());
  for (std::uint64_t record = 0; record < size; record += stride()) {
    for (const PlyProperty& each : element_->properties) {
      std::byte* const number = bytes.get() + record + each.offset;
      std::reverse(number, number + ply_scalar_size(each.type));
    }
  }
  return {bytes, size, file_.where()};
}

FileBytes PlyRecords::parsed(const PlyHeader& header) const {
  AsciiWords words(file_, header.size_bytes);
  for (const PlyElement* element = header.elements.data(); element != element_; ++element) {
    for (std::uint64_t record = 0; !element->properties.empty() && record < element->count; ++record) {
      for (std::size_t i = 0; i < element->properties.size(); ++i) {
        if (words.next().empty())
          file_.fail("it ends within element " + shortened(element->name), "get the file again, it seems cut short");
      }
    }
  }
  // A number and what parts it from the next are two bytes.
  const std::uint64_t least = 2 * std::max<std::uint64_t>(1, element_->properties.size());
  if (count() > (file_.size() - header.size_bytes) / least + 1) {
    file_.fail("it announces " + std::to_string(count()) + " records in element " + element_->name + " and has " +
                   std::to_string(file_.size()) + " bytes",
               "get the file again, it seems cut short");
  }
  std::vector<std::pair<PlyNumber, const PlyProperty*>> numbers;
  for (const PlyProperty& each : element_->properties) numbers.emplace_back(number(each.name), &each);
  const std::uint64_t size = count() * stride();
  const std::shared_ptr<std::byte[]> bytes = allocate_bytes(size, file_.where());
  for (std::uint64_t record = 0; record < count(); ++record) {
    for (const auto& [number, property] : numbers) {
      const std::string_view word = words.next();
      std::byte* const to = bytes.get() + record * stride() + number.offset;
      const bool is_number = with_type(number.type, [&, word = word](auto value) {
        const bool is_read = parse(word, value);
        std::memcpy(to, &value, sizeof value);
        return is_read;
      });
      if (is_number) continue;
      file_.fail_at(words.at(),
                    (word.empty() ? std::string("it ends") : "is `" + shortened(word) + "`") + ", where `" +
                        shortened(property->name) + "` of record " + std::to_string(record) + " of element " +
                        element_->name + " should be, a number (" + property->type + ")",
                    "get the file again");
    }
  }
  return {bytes, size, file_.where()};
}

double PlyNumber::of(const std::byte* record) const {
  return with_type(type, [&](auto value) {
    std::memcpy(&value, record + offset, sizeof value);
    return static_cast<double>(value);
  });
}

std::vector<std::string> PlyRecords::names() const {
  std::vector<std::string> names;
  for (const auto& [name, property] : properties_) names.push_back(name);
  return names;
}

std::uint64_t PlyRecords::rest_count() const {
  return static_cast<std::uint64_t>(
      std::count_if(element_->properties.begin(), element_->properties.end(),
                    [](const PlyProperty& property) { return property.name.rfind("f_rest_", 0) == 0; }));
}

const PlyProperty& PlyRecords::property(const std::string& name) const {
  const auto found = properties_.find(name);
  if (found == properties_.end()) {
    file_.fail("element " + element_->name + " has no property `" + name + "`", kExportRemedy);
  }
  return *found->second;
}

PlyNumber PlyRecords::number(const std::string& name) const {
  const PlyProperty& of = property(name);
  return {static_cast<std::uint32_t>(of.offset), type_of(of.type)};
}

std::uint32_t PlyRecords::offset(const std::string& name, std::string_view type) const {
  const PlyProperty& property = this->property(name);
  if (!same_type(property.type, type)) {
    file_.fail("property `" + name + "` has type `" + shortened(property.type) + "`",
               "convert it to " + std::string(type));
  }
  return static_cast<std::uint32_t>(property.offset);
}

int sh_degree_of_ply(std::uint64_t rest, const std::string& element, const FileBytes& file) {
  constexpr std::uint64_t kRestOfDegree4 = 72;
  const int degree = rest == kRestOfDegree4 ? 4 : rest % 3 == 0 ? sh_degree_of(rest / 3) : -1;
  if (degree < 0) {
    file.fail("element " + element + " has " + std::to_string(rest) + " properties f_rest_*",
              "SH degrees 0 to 4 have 0, 9, 24, 45 or 72 of them");
  }
  return degree;
}

}  // namespace vrpipe
