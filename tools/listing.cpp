#include "listing.h"

#include <iostream>

#include "output_file.h"

namespace vrpipe::tools {

void declare_json(CLI::App& app, Values& json) {
  add_option(app, "--json", json, "FILE|-", "writes the list as JSON; `-`: to stdout, in place of the text",
             "Where results go");
}

void print_listing(const Json& json, const std::string& text, const Values& json_option) {
  const auto place = single(json_option, "--json");
  if (!place) {
    std::cout << text;
    return;
  }
  const std::string content = json.dump(2) + "\n";
  if (*place == "-") {
    std::cout << content;
    return;
  }
  check_output_file(*place, "--json");
  write_output_file(*place, content, "--json");
}

}  // namespace vrpipe::tools
