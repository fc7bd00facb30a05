#include "cli/listing.h"

#include <iostream>

#include <nlohmann/json.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/component/printable.h>

#include "host/output_file.h"
#include "output/json_text.h"

namespace vrpipe::tools {

void declare_json(Arguments& arguments, Values& json, const std::string& what) {
  arguments.add_option("--json", json, "FILE|-",
                       "writes the " + what + " as JSON; `-`: to stdout, in place of the text", result_group);
}

Json json_triple(const Vec3& v) { return Json::array({v.x, v.y, v.z}); }

std::string markdown_escaped(const std::string& text) {
  std::string result;
  for (const char c : printable(text)) {
    if (c == '|' || c == '<') result += '\\';
    result += c;
  }
  return result;
}

void check_one_form(const char* option, bool is_given, const Values& json_option) {
  if (!is_given || single(json_option, "--json").value_or("") != "-") return;
  throw UserError("cannot print both", std::string(option) + ", --json -", "stdout has the list in one form",
                  "give one of them, or --json FILE");
}

void print_listing(const Json& json, const std::string& text, const Values& json_option, const Values& plugins) {
  const auto place = single(json_option, "--json");
  if (!place) {
    std::cout << text;
    return;
  }
  const std::string content = json_text(json);
  if (*place == "-") {
    std::cout << content;
    return;
  }
  check_output_file(*place, "--json");
  std::vector<NamedFile> inputs;
  for (const std::string& plugin : plugins) inputs.push_back({"--plugin", plugin});
  check_files_differ(inputs, {{"--json", *place}});
  write_output_file(*place, content, "--json");
}

}  // namespace vrpipe::tools
