#include "scene_cache.h"

#include <elf.h>
#include <link.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include <vrpipe/component/error.h>

#include "../file_io.h"

namespace vrpipe {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostSceneBytes = 256'000'000, kMostCacheBytes = 512'000'000;

using BuildId = std::array<unsigned char, 20>;

/// The build id in the notes of a loaded object, or zeros.
BuildId id_in_notes(const dl_phdr_info& object) {
  BuildId id{};
  for (unsigned i = 0; i < object.dlpi_phnum; ++i) {
    const ElfW(Phdr)& segment = object.dlpi_phdr[i];
    if (segment.p_type != PT_NOTE) continue;
    const auto* at = reinterpret_cast<const unsigned char*>(object.dlpi_addr + segment.p_vaddr);
    const unsigned char* const end = at + segment.p_memsz;
    const auto padded = [](std::size_t bytes) { return (bytes + 3) / 4 * 4; };
    while (at + sizeof(ElfW(Nhdr)) <= end) {
      ElfW(Nhdr) note;
      std::memcpy(&note, at, sizeof note);
      const unsigned char* const description = at + sizeof note + padded(note.n_namesz);
      constexpr char kOwner[] = "GNU";  // with its end
      const bool is_gnu = note.n_namesz == sizeof kOwner && std::memcmp(at + sizeof note, kOwner, sizeof kOwner) == 0;
      if (is_gnu && note.n_type == NT_GNU_BUILD_ID) {
        std::memcpy(id.data(), description, std::min<std::size_t>(note.n_descsz, id.size()));
        return id;
      }
      at = description + padded(note.n_descsz);
    }
  }
  return id;
}

/// Of the library or program that this code is in; zeros if it was linked without.
BuildId own_build_id() {
  BuildId id{};
  dl_iterate_phdr(
      [](dl_phdr_info* object, std::size_t, void* found) {
        const auto here = reinterpret_cast<ElfW(Addr)>(&id_in_notes);
        for (unsigned i = 0; i < object->dlpi_phnum; ++i) {
          const ElfW(Phdr)& segment = object->dlpi_phdr[i];
          const ElfW(Addr) start = object->dlpi_addr + segment.p_vaddr;
          if (segment.p_type == PT_LOAD && here >= start && here < start + segment.p_memsz) {
            *static_cast<BuildId*>(found) = id_in_notes(*object);
            return 1;
          }
        }
        return 0;
      },
      &id);
  return id;
}

/// What a file begins with; the records follow, as GaussianArray holds them.
struct Header {
  std::array<char, 8> magic{'v', 'r', 'p', ' ', 's', 'c', 'n', '1'};
  BuildId build_id{};
  std::uint32_t sh_degree = 0;
  std::uint64_t count = 0;
  std::uint64_t checksum = 0;  ///< Adler-32 of the records and the scene's name
};
static_assert(sizeof(Header) == 48, "without padding");

std::uint64_t checksum_of(const std::string& name, const std::byte* bytes, std::size_t count) {
  const auto of_name = adler32_z(1, reinterpret_cast<const unsigned char*>(name.data()), name.size());
  return adler32_z(of_name, reinterpret_cast<const unsigned char*>(bytes), count);
}

/// Where a scene of this build is stored; none if there is no folder for it, or nothing to know the build by.
std::optional<fs::path> file_of(const std::string& name, const BuildId& id) {
  const auto folder = user_cache_folder();
  if (!folder || id == BuildId{}) return std::nullopt;
  std::string hex;
  for (std::size_t i = 0; i < 8; ++i) {
    hex += "0123456789abcdef"[id[i] >> 4U];
    hex += "0123456789abcdef"[id[i] & 15U];
  }
  return *folder / "scenes" / (name + "-" + hex + ".scene");
}

/// Removes the oldest scenes, of whatever build, until the rest takes little.
void keep_small(const fs::path& folder) {
  struct Stored {
    fs::file_time_type written;
    fs::path path;
    std::uint64_t bytes;
  };
  std::vector<Stored> all;
  std::uint64_t bytes = 0;
  std::error_code ignored;
  for (fs::directory_iterator entry(folder, ignored), end; !ignored && entry != end; entry.increment(ignored)) {
    std::error_code gone;  // another process may have removed it
    const std::uint64_t size = entry->file_size(gone);
    const fs::file_time_type written = entry->last_write_time(gone);
    if (gone || entry->path().extension() != ".scene") continue;
    all.push_back({written, entry->path(), size});
    bytes += size;
  }
  std::sort(all.begin(), all.end(), [](const Stored& a, const Stored& b) { return a.written < b.written; });
  for (const Stored& oldest : all) {
    if (bytes <= kMostCacheBytes) return;
    fs::remove(oldest.path, ignored);
    bytes -= oldest.bytes;
  }
}

}  // namespace

std::optional<GaussianScene> cached_scene(const std::string& name) {
  const BuildId id = own_build_id();
  const auto path = file_of(name, id);
  std::error_code error;
  if (!path || !fs::is_regular_file(*path, error)) return std::nullopt;
  try {
    const InputFile file(*path, "cannot read cached scene");
    Header header;
    const Header expected;
    if (file.size() < sizeof header || file.size() > sizeof header + kMostSceneBytes) return std::nullopt;
    file.read(0, &header, sizeof header);
    if (header.magic != expected.magic || header.build_id != id || header.sh_degree > 3) return std::nullopt;
    const int sh_degree = static_cast<int>(header.sh_degree);
    const std::uint64_t bytes = file.size() - sizeof header, stride = GaussianArray::bytes_per_gaussian(sh_degree);
    if (header.count != bytes / stride || bytes % stride != 0) return std::nullopt;
    GaussianArray gaussians(header.count, sh_degree, name);
    file.read(sizeof header, gaussians.bytes(), static_cast<std::size_t>(bytes));
    if (checksum_of(name, gaussians.bytes(), static_cast<std::size_t>(bytes)) != header.checksum) return std::nullopt;
    return gaussians.build();
  } catch (const UserError&) {
    return std::nullopt;
  }
}

void cache_scene(const std::string& name, const GaussianScene& scene) {
  const BuildId id = own_build_id();
  const auto path = file_of(name, id);
  const std::uint64_t bytes = scene.size() * GaussianArray::bytes_per_gaussian(scene.sh_degree());
  if (!path || bytes > kMostSceneBytes) return;
  std::error_code error;
  fs::create_directories(path->parent_path(), error);
  if (error) return;
  Header header;
  header.build_id = id;
  header.sh_degree = static_cast<std::uint32_t>(scene.sh_degree());
  header.count = scene.size();
  header.checksum = checksum_of(name, scene.records(), static_cast<std::size_t>(bytes));
  try {
    AtomicFile file(*path, "cannot cache scene", path->string());
    file.write(&header, sizeof header);
    file.write(scene.records(), static_cast<std::size_t>(bytes));
    file.commit();
  } catch (const UserError&) {
    return;  // a full disk, or a folder that cannot be written
  }
  keep_small(path->parent_path());
}

}  // namespace vrpipe
