#include "component/plugin_tag.h"

#include <elf.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>
#include <vector>

#include <vrpipe/component/error.h>

namespace vrpipe {

namespace {

constexpr std::size_t longest_tag = 256;
constexpr std::size_t largest_table = std::size_t{1} << 28;  ///< of symbols or names, bytes; beyond, a file is broken

/// An ELF file, piece by piece: a plugin may be large.
class ElfFile {
 public:
  explicit ElfFile(const std::string& path) : file_(path, std::ios::binary) {
    if (!file_) throw UserError("cannot load plugin", path, std::generic_category().message(errno), "make it readable");
  }

  template <class Item>
  bool read(std::uint64_t offset, Item& out) {
    return read(offset, &out, sizeof out);
  }
  bool read(std::uint64_t offset, void* to, std::size_t bytes) {
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(offset));
    return static_cast<bool>(file_.read(static_cast<char*>(to), static_cast<std::streamsize>(bytes)));
  }
  template <class Item>
  std::vector<Item> table(const Elf64_Shdr& section) {
    if (section.sh_size > largest_table) return {};
    std::vector<Item> items(section.sh_size / sizeof(Item));
    if (!read(section.sh_offset, items.data(), items.size() * sizeof(Item))) items.clear();
    return items;
  }
  /// Up to the first NUL; what is cut off or too long is empty.
  std::string text(std::uint64_t offset) {
    char buffer[longest_tag] = {};
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(offset));
    file_.read(buffer, sizeof buffer);
    const std::size_t length = strnlen(buffer, static_cast<std::size_t>(file_.gcount()));
    return length < static_cast<std::size_t>(file_.gcount()) ? std::string(buffer, length) : std::string();
  }

 private:
  std::ifstream file_;
};

}  // namespace

std::string plugin_tag(const std::string& path) {
  ElfFile file(path);
  Elf64_Ehdr header;
  if (!file.read(0, header) || std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0) return {};
  if (header.e_ident[EI_CLASS] != ELFCLASS64 || header.e_shentsize != sizeof(Elf64_Shdr)) return {};
  std::vector<Elf64_Shdr> sections(header.e_shnum);
  if (!file.read(header.e_shoff, sections.data(), sections.size() * sizeof(Elf64_Shdr))) return {};
  for (const Elf64_Shdr& section : sections) {
    if (section.sh_type != SHT_DYNSYM || section.sh_link >= sections.size()) continue;
    std::vector<char> names = file.table<char>(sections[section.sh_link]);
    names.push_back('\0');
    for (const Elf64_Sym& symbol : file.table<Elf64_Sym>(section)) {
      if (symbol.st_name >= names.size() || symbol.st_shndx >= sections.size()) continue;
      if (std::strcmp(&names[symbol.st_name], "vrpipe_plugin_tag") != 0) continue;
      const Elf64_Shdr& holder = sections[symbol.st_shndx];
      return file.text(symbol.st_value - holder.sh_addr + holder.sh_offset);
    }
  }
  return {};
}

}  // namespace vrpipe
