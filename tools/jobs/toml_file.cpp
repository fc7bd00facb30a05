#include "jobs/toml_file.h"

#include <algorithm>
#include <fstream>
#include <iterator>

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/builtin_scenes.h>

#include "jobs/toml_text.h"

namespace vrpipe::tools {
namespace {

void add_leaves(const toml::table& table, const std::string& leaf, const std::string& prefix, TomlFile::Entries& all) {
  for (const auto& [key, node] : table) {
    const std::string name = prefix + std::string(key.str());
    const toml::table* const inner = node.as_table();
    if (inner != nullptr && (leaf.empty() || !inner->contains(leaf))) {
      add_leaves(*inner, leaf, name + ".", all);
    } else {
      all.emplace_back(name, &node);
    }
  }
}

void sort_by_position(TomlFile::Entries& entries) {
  std::stable_sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) {
    return TomlFile::position(*a.second) < TomlFile::position(*b.second);
  });
}

}  // namespace

TomlFile::TomlFile(const std::filesystem::path& path, const std::string& what, const std::string& where,
                   const std::string& page)
    : path_(path) {
  std::error_code ignored;
  const bool is_folder = std::filesystem::is_directory(path_, ignored);
  std::ifstream file(path_, std::ios::binary);
  if (!file || is_folder) {
    throw UserError(what, where, is_folder ? "it is a directory" : "there is no such file, or it may not be read",
                    "name a TOML file; " + page + " describes it");
  }
  const std::string content(std::istreambuf_iterator<char>(file), {});
  root_ = parse_toml(content, path_.string(), [&](const toml::source_region& source, const std::string& why) {
    throw UserError(what, place(source), why, "correct it; " + page + " describes the file");
  });
}

void TomlFile::refuse(const toml::node& node, const std::string& what, const std::string& why,
                      const std::string& remedy) const {
  throw UserError(what, place(node.source()), why, remedy);
}

std::string TomlFile::scalar(const toml::node& node, const std::string& key) const {
  if (const auto* text = node.as_string()) return text->get();
  if (const auto* number = node.as_integer()) return std::to_string(number->get());
  if (const auto* number = node.as_floating_point()) return fmt::format("{}", number->get());
  if (const auto* flag = node.as_boolean()) return flag->get() ? "on" : "off";
  refuse(node, "bad value of '" + key + "'", "it is no text, number, true or false", "give one of them");
}

toml::source_position TomlFile::position(const toml::node& node) {
  toml::source_position first = node.source().begin;
  if (const toml::table* table = node.as_table()) {
    for (const auto& [key, value] : *table) {
      const toml::source_position inner = position(value);
      if (!first || inner < first) first = inner;
    }
  }
  return first;
}

TomlFile::Entries TomlFile::in_order(const toml::table& table) {
  Entries entries;
  for (const auto& [key, node] : table) entries.emplace_back(std::string(key.str()), &node);
  sort_by_position(entries);
  return entries;
}

TomlFile::Entries TomlFile::leaves(const toml::table& table, const std::string& leaf) {
  Entries all;
  add_leaves(table, leaf, "", all);
  sort_by_position(all);
  return all;
}

std::string TomlFile::place(const toml::source_region& region) const {
  return fmt::format("{}:{}", path_.string(), region.begin.line);
}

std::string with_file(const std::string& text, bool is_named,
                      const std::function<std::filesystem::path(const std::filesystem::path&)>& change) {
  if (text == "-" || builtin_name_of(text)) return text;
  const std::size_t equals = is_named ? text.find('=') : std::string::npos;
  const std::size_t name = equals == std::string::npos ? 0 : equals + 1;
  return text.substr(0, name) + change(text.substr(name)).string();
}

std::filesystem::path in_folder(const std::filesystem::path& folder, const std::filesystem::path& file) {
  return file.is_absolute() ? file : folder / file;
}

}  // namespace vrpipe::tools
