#include <vrpipe/memory/cache_organization.h>

#include <fmt/format.h>

#include <vrpipe/component/error.h>

namespace vrpipe {

namespace {
bool is_power_of_two(std::uint64_t value) { return value != 0 && (value & (value - 1)) == 0; }
}  // namespace

void CacheOrganization::check(const std::string& cache, const std::string& component,
                              const std::string& bytes_name) const {
  const auto require = [&](bool holds, const std::string& where, const std::string& why, const std::string& remedy) {
    if (!holds) throw UserError("unusable " + cache, where, why, remedy);
  };
  const std::string of_bytes = component + "." + bytes_name;
  const std::string of_line = component + ".line_bytes";
  const std::string of_sector = component + ".sector_bytes";
  const std::string of_ways = component + ".ways";
  require(is_power_of_two(line_bytes), of_line, fmt::format("{} is no power of two", line_bytes), "use a power of two");
  require(is_power_of_two(sector_bytes), of_sector, fmt::format("{} is no power of two", sector_bytes),
          "use a power of two");
  require(line_bytes <= bytes, of_line + ", " + of_bytes,
          fmt::format("{} bytes do not fit into a cache of {}", line_bytes, bytes), "use sector <= line <= cache");
  require(sector_bytes <= line_bytes, of_sector + ", " + of_line,
          fmt::format("{} bytes do not fit into a line of {}", sector_bytes, line_bytes),
          "use sector <= line <= cache");
  require(sectors_of_a_line() <= 32, of_line + ", " + of_sector,
          fmt::format("a line has {} sectors", sectors_of_a_line()), "use at most 32 sectors a line");
  require(bytes % line_bytes == 0, of_bytes, fmt::format("{} bytes are no whole lines of {}", bytes, line_bytes),
          "use a multiple of the line");
  const std::uint64_t set_bytes = std::uint64_t{ways_of_a_set()} * line_bytes;
  require(set_bytes <= bytes, of_ways + ", " + of_bytes,
          fmt::format("{} ways of {} bytes are more than the cache of {}", ways, line_bytes, bytes),
          fmt::format("use at most {} ways, or 0 for a fully associative cache", lines()));
  require(bytes % set_bytes == 0, of_ways + ", " + of_bytes,
          fmt::format("{} lines are no whole sets of {} ways", lines(), ways),
          "use a number of ways that divides the number of lines");
  if (replacement == Replacement::tree_plru) {
    const std::uint32_t leaves = ways_of_a_set();
    require(is_power_of_two(leaves) && leaves >= 2 && leaves <= 64, component + ".replacement, " + of_ways,
            fmt::format("a tree has 2 to 64 ways, a power of two, and this has {}", leaves),
            "use other ways or lru, fifo or random");
  }
}

CacheParameters::CacheParameters(ParameterSet& owner, const Defaults& defaults)
    : bytes(owner, defaults.bytes_name, defaults.bytes, 128, defaults.most_bytes, "bytes", source::paper_table,
            defaults.bytes_meaning),
      line_bytes(owner, "line_bytes", 128, 32, 1024, "bytes", source::paper_table, "of a cache line"),
      sector_bytes(owner, "sector_bytes", 32, 16, 1024, "bytes", source::paper_table, "of a cache sector"),
      ways(owner, "ways", defaults.ways, 0, 65536, "lines", defaults.ways_source, "of a set; 0: fully associative"),
      replacement(owner, "replacement", {"lru", "fifo", "random", "tree-plru"}, 0, source::open,
                  "of the lines of a set that nobody waits for, which one goes"),
      random_seed(owner, "random_seed", 0, 0, 0xffffffffU, "", source::open, "of random replacement"),
      hash_sets(
          owner, "hash_sets", false, source::open,
          "a line's set follows from all bits of its address, not from its number mod sets alone: they are XORed, "
          "or, where sets are no power of two, a pseudo-random number of the higher ones is added"),
      tell_conflicts(owner, "tell_conflicts", false, "takes the host's time",
                     "tell conflict misses from capacity misses, among which they are counted otherwise") {}

CacheOrganization CacheParameters::organization() const {
  CacheOrganization made;
  made.bytes = bytes;
  made.line_bytes = line_bytes;
  made.sector_bytes = sector_bytes;
  made.ways = ways;
  made.replacement = static_cast<Replacement>(static_cast<unsigned>(replacement));
  made.random_seed = random_seed;
  made.hashes_sets = hash_sets;
  made.tells_conflicts = tell_conflicts;
  return made;
}

RopMshrs::RopMshrs(ParameterSet& owner)
    : Integer(owner, "mshrs", 384, 1, 65536, "sectors", "Accel-Sim, SM87_ORIN: 384 MSHRs of a first-level cache",
              "fills in flight, and as many write-backs") {}

RopSectorsPerCycle::RopSectorsPerCycle(ParameterSet& owner, const char* meaning)
    : Integer(owner, "sectors_per_cycle", 16, 1, 64, "sectors",
              "measured on a GH100 graphics GPC: 8 a cycle and ROP partition; the paper's GPC has two", meaning) {}

}  // namespace vrpipe
