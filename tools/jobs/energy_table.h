#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include <vrpipe/platforms/simulation.h>

namespace vrpipe::tools {

/// A quantity that is known to lie between two values; low <= nominal <= high.
struct Range {
  double low = 0, nominal = 0, high = 0;

  Range& operator+=(const Range& other);
  Range operator*(double factor) const { return {low * factor, nominal * factor, high * factor}; }
};

/// A number times counters, counts and parameters of a run.
struct CountProduct {
  double factor = 1;
  std::vector<std::string> names;
};

/// How often something happens: a sum of products.
struct CountFormula {
  std::vector<CountProduct> products;
  std::string text;   ///< as it was written, the products with + between them
  std::string where;  ///< file and line, for messages
};

/// From the process of a published figure to that of the GPU.
struct ProcessNode {
  std::string name;  ///< e.g. "12 nm"
  Range factor;      ///< the supply apart
  double voltage_ratio = 1;
  std::string source;

  Range scaling() const { return factor * (voltage_ratio * voltage_ratio); }
};

struct EnergyEvent {
  std::string name;
  std::string unit;  ///< that spends it, e.g. "L2"
  CountFormula count;
  Range published;                ///< pJ, in the process of `node`
  std::string node;               ///< of ProcessNode
  std::vector<Range> picojoules;  ///< in the process of the GPU, by EnergyTable::processes
  std::string source;
  std::string meaning;
};

/// Power that is there whatever moves.
struct ConstantPower {
  std::string name;
  CountFormula count;         ///< of what takes it each, all of the time
  bool is_of_cycles = false;  ///< `count` is of cycles instead, summed over all that take it: while they are active
  Range watts;
  std::vector<std::string> platforms;  ///< for which it was found; empty: all
  std::string source;
  std::string meaning;
};

/// A process that GPUs are made in.
struct GpuProcess {
  std::string name;                    ///< e.g. "8 nm"
  std::vector<std::string> platforms;  ///< made in it
  std::vector<ProcessNode> nodes;      ///< to it, in the order of the first process's
  std::string leaves_out;              ///< of these platforms' energy, e.g. "idle power"; empty: nothing
};

/// What events cost.
struct EnergyTable {
  std::vector<GpuProcess> processes;  ///< the first: of all platforms that no other names
  std::vector<EnergyEvent> events;
  std::vector<ConstantPower> powers;

  std::size_t process_of(const std::string& platform) const;  ///< in `processes`
  /// Whether a platform takes a power: one that was found for it, or, where none was, for others in its process.
  bool is_taken(const ConstantPower& power, const std::string& platform) const;
};

/// What a count may name of a compute kernel of a frame: warp instructions, those of the lanes that take part, bytes read and
/// written, of these what goes to a DRAM, where there is one, and cycles in which cores have warps, of all cores.
constexpr std::array<const char*, 5> kernel_numbers{"kernel.warp_instructions", "kernel.lane_instructions",
                                                    "kernel.bytes", "kernel.dram_bytes", "kernel.core_cycles"};

/// The table that comes with the program, as TOML.
const char* shipped_energies_text();
const EnergyTable& shipped_energies();

/// @param where  the file, in messages
/// Throws UserError, which names the line.
EnergyTable parse_energies(const std::string& text, const std::string& where);
EnergyTable read_energies(const std::filesystem::path& path);

/// That all names in counts are those of counters, counts or numeric parameters which the platform's units can have.
/// Throws UserError naming the nearest. Not while a simulation of this process is elaborated.
void check_energy_names(const EnergyTable& table, const Platform& platform);

}  // namespace vrpipe::tools
