#include "formats/ply_records.h"

#include <algorithm>

#include "formats/attribute_codes.h"

namespace vrpipe {
namespace {

constexpr char kExportRemedy[] = "export the scene as an INRIA 3D Gaussian splatting .ply (binary, little-endian)";

bool same_type(std::string_view a, std::string_view b) {
  const auto plain = [](std::string_view type) {
    if (type == "float32") return std::string_view("float");
    if (type == "uint32") return std::string_view("uint");
    if (type == "uint8") return std::string_view("uchar");
    return type;
  };
  return plain(a) == plain(b);
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
  if (header.format != "binary_little_endian 1.0") {
    file.fail("its format is `" + shortened(header.format) + "`",
              "convert it to `binary_little_endian 1.0`, the only one that is read");
  }
  return header;
}

PlyRecords::PlyRecords(const FileBytes& file, const PlyHeader& header, const std::string& name)
    : file_(file), element_(header.element(name)) {
  if (element_ == nullptr) file.fail("the header has no element " + name, kExportRemedy);
  std::uint64_t offset = header.size_bytes;
  for (const PlyElement* element = header.elements.data(); element != element_; ++element) {
    refuse_lists(file, *element, " before element " + name, "write element " + name + " first");
    file.records(offset, element->count, element->stride_bytes, "element " + shortened(element->name));
    offset += element->count * element->stride_bytes;
  }
  refuse_lists(file, *element_, "", "a Gaussian has scalar properties only; remove the list");
  for (const PlyProperty& property : element_->properties) {
    if (!properties_.emplace(property.name, &property).second) {
      file.fail("property `" + shortened(property.name) + "` occurs twice in element " + name, kExportRemedy);
    }
  }
  data_ = file.records(offset, count(), stride(), "element " + name);
}

std::uint64_t PlyRecords::rest_count() const {
  return static_cast<std::uint64_t>(
      std::count_if(element_->properties.begin(), element_->properties.end(),
                    [](const PlyProperty& property) { return property.name.rfind("f_rest_", 0) == 0; }));
}

std::uint32_t PlyRecords::offset(const std::string& name, std::string_view type) const {
  const auto found = properties_.find(name);
  if (found == properties_.end()) {
    file_.fail("element " + element_->name + " has no property `" + name + "`", kExportRemedy);
  }
  const PlyProperty& property = *found->second;
  if (!same_type(property.type, type)) {
    file_.fail("property `" + name + "` has type `" + shortened(property.type) + "`",
               "convert it to " + std::string(type));
  }
  return static_cast<std::uint32_t>(property.offset);
}

int sh_degree_of_ply(std::uint64_t rest, const std::string& element, const FileBytes& file) {
  const int degree = rest % 3 == 0 ? sh_degree_of(rest / 3) : -1;
  if (degree < 0) {
    file.fail("element " + element + " has " + std::to_string(rest) + " properties f_rest_*",
              "SH degrees 0 to 3 have 0, 9, 24 or 45 of them");
  }
  return degree;
}

}  // namespace vrpipe
