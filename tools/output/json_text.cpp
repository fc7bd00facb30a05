#include "output/json_text.h"

#include <vrpipe/component/printable.h>

namespace vrpipe::tools {
namespace {

using Json = nlohmann::ordered_json;

Json with_valid_texts(const Json& json) {
  if (json.is_string()) return valid_utf8(json.get_ref<const std::string&>());
  if (!json.is_structured()) return json;
  Json copy(json.type());
  for (const auto& [key, value] : json.items()) {
    if (json.is_array()) {
      copy.push_back(with_valid_texts(value));
    } else {
      copy[valid_utf8(key)] = with_valid_texts(value);
    }
  }
  return copy;
}

}  // namespace

std::string json_text(const Json& json) { return with_valid_texts(json).dump(2) + "\n"; }

}  // namespace vrpipe::tools
