#pragma once

#include <string>

#include <vrpipe/workloads/camera.h>

#include "cli/arguments.h"
#include "output/result_json.h"

namespace vrpipe::tools {

// What the commands that list things have in common.

/// Adds `--json FILE|-`. `what` is written to it: "list".
void declare_json(Arguments& arguments, Values& json, const std::string& what);

Json json_triple(const Vec3& v);

/// As a cell of a table, on one line.
std::string markdown_escaped(const std::string& text);

/// Throws UserError if an option, which asks for another form, comes with `--json -`: stdout has one.
void check_one_form(const char* option, bool is_given, const Values& json_option);

/// Prints the text, or writes the JSON to where --json says, which must not be one of the plugins. Throws UserError.
void print_listing(const Json& json, const std::string& text, const Values& json_option, const Values& plugins = {});

}  // namespace vrpipe::tools
