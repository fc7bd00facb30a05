#pragma once

#include <algorithm>
#include <cstdint>
#include <string>

#include <vrpipe/component/parameter.h>

namespace vrpipe {

/// Which line of a set goes for another.
enum class Replacement : std::uint8_t {
  lru,        ///< the one not used for the longest time
  fifo,       ///< the one held for the longest time
  random,     ///< any, by a seeded sequence
  tree_plru,  ///< the one that a binary tree of bits, which point away from what was used, leads to
};
/// What a write of a part of a sector does that is not there.
enum class WriteAllocate : std::uint8_t {
  fill,       ///< has the sector filled
  byte_mask,  ///< nothing: a mask says which bytes are there (write-validate: Jouppi, "Cache write policies", 1993)
};

/// How a sectored cache is made: bytes = sets x ways x bytes of a line.
struct CacheOrganization {
  std::uint64_t bytes = 0;
  std::uint32_t line_bytes = 128;
  std::uint32_t sector_bytes = 32;
  std::uint32_t ways = 0;  ///< 0: as many as lines, fully associative
  Replacement replacement = Replacement::lru;
  std::uint32_t random_seed = 0;
  /// The set follows from all bits of the address, not from the line's number mod sets alone (Interleaving). For a power of
  /// two of sets it is an exclusive or of all groups of bits (Gonzalez et al., "Eliminating cache conflict misses through
  /// XOR-based placement functions", 1997).
  bool hashes_sets = false;
  WriteAllocate write_allocate = WriteAllocate::fill;
  /// Tells conflict misses from capacity misses, which takes a second cache's time.
  bool tells_conflicts = false;

  std::uint32_t lines() const { return static_cast<std::uint32_t>(bytes / line_bytes); }
  std::uint32_t ways_of_a_set() const { return ways == 0 ? lines() : ways; }
  std::uint32_t sets() const { return ways == 0 ? 1 : lines() / ways; }
  std::uint32_t sectors_of_a_line() const { return line_bytes / sector_bytes; }
  /// Of half a line, or the only one.
  std::uint32_t sectors_of_a_half() const { return std::max(sectors_of_a_line() / 2, 1U); }

  /// Throws UserError for a cache that cannot be. Bytes of a line and of a sector are powers of two, sets any number;
  /// sector <= line <= cache; the cache is whole sets of whole lines; a line has at most 32 sectors; a tree has 2 to 64
  /// ways, a power of two.
  /// @param cache       in words, "CROP cache"
  /// @param component   whose parameters these are, "crop"
  /// @param bytes_name  of the parameter for `bytes`
  void check(const std::string& cache, const std::string& component, const std::string& bytes_name) const;
};

/// Its parameters, for a component to have among its own.
struct CacheParameters {
  struct Defaults {
    const char* bytes_name;
    std::uint32_t bytes;
    std::uint32_t most_bytes;
    const char* bytes_meaning;
    std::uint32_t ways;
    const char* ways_source;
  };
  CacheParameters(ParameterSet& owner, const Defaults& defaults);
  CacheOrganization organization() const;

  Integer bytes;
  Integer line_bytes;
  Integer sector_bytes;
  Integer ways;
  Choice replacement;
  Integer random_seed;
  Switch hash_sets;
  Switch tell_conflicts;
};

/// Parameter `mshrs` of a ROP's cache: sectors in flight.
struct RopMshrs : Integer {
  explicit RopMshrs(ParameterSet& owner);
};

/// Parameter `sectors_per_cycle` of a ROP's cache; its meaning says what the ROP does in other cycles.
struct RopSectorsPerCycle : Integer {
  RopSectorsPerCycle(ParameterSet& owner, const char* meaning);
};

}  // namespace vrpipe
