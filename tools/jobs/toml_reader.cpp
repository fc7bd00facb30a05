#include "jobs/toml_reader.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <fmt/format.h>

#include <vrpipe/component/error.h>

#include "file_io.h"
#include "jobs/toml_text.h"

namespace vrpipe::tools {

std::string TomlReader::line(const toml::source_region& source) const {
  return fmt::format("{} line {}", file_, source.begin.line);
}

void TomlReader::refuse(const toml::node& where, const std::string& why, const std::string& remedy) const {
  throw UserError(what_, line(where.source()), why, remedy);
}

toml::table TomlReader::parsed(const std::string& text, const std::string& schema,
                               const std::vector<std::string>& keys) const {
  toml::table root = parse_toml(text, file_, [&](const toml::source_region& source, std::string why) {
    std::replace(why.begin(), why.end(), '\n', ' ');
    throw UserError(what_, line(source), why, "write TOML 1.0, " + example_);
  });
  check_keys(root, keys);
  if (text_at(root, "schema") != schema) {
    refuse(*root.get("schema"), "schema is not " + schema, fmt::format("write schema = \"{}\"", schema));
  }
  return root;
}

void TomlReader::check_keys(const toml::table& table, const std::vector<std::string>& known) const {
  for (const auto& [key, value] : table) {
    const std::string name(key.str());
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    throw UserError(what_, line(key.source()), fmt::format("unknown key '{}'", name), suggestion(name, known));
  }
}

std::vector<const toml::table*> TomlReader::tables(const toml::table& parent, const char* key) const {
  std::vector<const toml::table*> found;
  const toml::node* const node = parent.get(key);
  if (node == nullptr) return found;
  if (!node->is_array_of_tables()) {
    refuse(*node, fmt::format("{} is no array of tables", key), fmt::format("write [[{}]]", key));
  }
  for (const toml::node& each : *node->as_array()) found.push_back(each.as_table());
  return found;
}

const toml::node& TomlReader::at(const toml::table& table, const char* key, const std::string& example) const {
  const toml::node* const found = table.get(key);
  if (found == nullptr) {
    auto name = table["name"].value<std::string>();
    if (!name) name = table["id"].value<std::string>();
    refuse(table, fmt::format("{} has no {}", name ? "'" + *name + "'" : "it", key),
           fmt::format("add {} = {}", key, example));
  }
  return *found;
}

std::string TomlReader::text_at(const toml::table& table, const char* key) const {
  const toml::node& found = at(table, key, "\"...\"");
  const auto text = found.value_exact<std::string>();
  if (!text || text->empty()) refuse(found, fmt::format("{} is not a text", key), "write a text in quotes");
  return *text;
}

double TomlReader::number(const toml::node& node, const std::string& what) const {
  const auto value = node.is_number() ? node.value<double>() : std::nullopt;
  if (!value || !std::isfinite(*value)) refuse(node, what + " is not a number", "write a number, as 4.5");
  if (*value < 0) refuse(node, what + " is negative", "write 0 or more");
  return *value;
}

std::string table_text(const std::filesystem::path& path, const std::string& what) {
  const InputFile file(path, what);
  std::string text(static_cast<std::size_t>(file.size()), '\0');
  file.read(0, text.data(), text.size());
  file.check_unchanged();
  return text;
}

}  // namespace vrpipe::tools
