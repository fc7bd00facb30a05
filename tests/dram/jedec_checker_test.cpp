// The checker itself: it takes what keeps a rule to the cycle, and finds what breaks it by one.

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "jedec_checker.h"

namespace vrpipe {
namespace {

using Kind = DramCommand::Kind;
using testing::JedecChecker;

DramCommand activate(Cycle at, unsigned bank, std::uint64_t row = 7) { return {at, Kind::activate, bank, row, 0}; }
DramCommand read_command(Cycle at, unsigned bank, std::uint64_t row = 7) { return {at, Kind::read, bank, row, 0}; }
DramCommand write_command(Cycle at, unsigned bank, std::uint64_t row = 7) { return {at, Kind::write, bank, row, 0}; }
DramCommand precharge(Cycle at, unsigned bank) { return {at, Kind::precharge, bank, 0, 0}; }
DramCommand precharge_all(Cycle at) { return {at, Kind::precharge_all, 0, 0, 0}; }
DramCommand refresh(Cycle at) { return {at, Kind::refresh, 0, 0, 0}; }

/// The last command is as early as the rule allows.
struct Case {
  const DramDevice& device;
  std::string rule;
  std::vector<DramCommand> commands;
};

std::vector<Case> cases() {
  // LPDDR3-1600, cycles of 1.25 ns: tRCD 15, RL 12, WL 6, tRP 15, tRPab 17, tRAS 34, tRC 48, tWR 12, tDQSS 1, tWTR 6,
  // tRTP 6, tRRD 8, tFAW 40, tCCD 4, tRTW 2, tRFC 104; bursts of 4. LPDDR5-6400: tRCD 15, tRAS 34, tCCD 2, tCCD_L 4,
  // tWTR 5, tWTR_L 10, WL 9, bursts of 2; banks 0 and 4 are of one group, and activates are made to take 2 cycles.
  return {
      {lpddr3_1600, "tRCD", {activate(0, 0), read_command(15, 0)}},
      {lpddr3_1600, "tRCD", {activate(0, 0), write_command(15, 0)}},
      {lpddr3_1600, "tRAS", {activate(0, 0), precharge(34, 0)}},
      {lpddr3_1600, "tRAS", {activate(0, 0), precharge_all(34)}},
      {lpddr3_1600, "tRP", {activate(0, 0), precharge(40, 0), activate(55, 0)}},
      {lpddr3_1600, "tRC", {activate(0, 0), precharge(30, 0), activate(48, 0)}},
      {lpddr3_1600, "tRPab", {activate(0, 0), precharge_all(40), activate(57, 0)}},
      {lpddr3_1600, "tRPab", {activate(0, 0), precharge_all(40), refresh(57)}},
      {lpddr3_1600, "tRP", {activate(0, 0), precharge(40, 0), refresh(55)}},
      {lpddr3_1600, "tRRD", {activate(0, 0), activate(8, 1)}},
      {lpddr3_1600, "tFAW", {activate(0, 0), activate(8, 1), activate(16, 2), activate(24, 3), activate(40, 4)}},
      {lpddr3_1600, "tRTP", {activate(0, 0), read_command(40, 0), precharge(46, 0)}},
      {lpddr3_1600, "tWR", {activate(0, 0), write_command(20, 0), precharge(20 + 6 + 1 + 4 + 12, 0)}},
      {lpddr3_1600, "tCCD", {activate(0, 0), read_command(20, 0), read_command(24, 0)}},
      {lpddr3_1600, "data bus", {activate(0, 0), write_command(20, 0), write_command(24, 0)}},
      {lpddr3_1600, "tWTR", {activate(0, 0), write_command(20, 0), read_command(20 + 6 + 1 + 4 + 6, 0)}},
      {lpddr3_1600, "tRTW", {activate(0, 0), read_command(20, 0), write_command(20 + 12 + 4 + 2 - 6, 0)}},
      {lpddr3_1600, "tRFC", {refresh(10), activate(114, 0)}},
      {lpddr3_1600, "tRFC", {refresh(10), refresh(114)}},
      {lpddr3_1600, "one command at a time", {precharge(10, 0), precharge(11, 1)}},
      {lpddr5_6400, "one command at a time", {activate(10, 0), precharge(12, 1)}},
      {lpddr5_6400, "tRCD", {activate(0, 0), read_command(16, 0)}},
      {lpddr5_6400, "tRAS", {activate(0, 0), precharge(35, 0)}},
      {lpddr5_6400, "tCCD_L", {activate(0, 0), activate(4, 4), read_command(30, 0), read_command(34, 4)}},
      {lpddr5_6400, "tCCD", {activate(0, 0), activate(4, 1), read_command(30, 0), read_command(32, 1)}},
      {lpddr5_6400, "tWTR_L", {activate(0, 0), activate(4, 4), write_command(30, 0), read_command(30 + 9 + 2 + 10, 4)}},
      {lpddr5_6400, "tWTR", {activate(0, 0), activate(4, 1), write_command(30, 0), read_command(30 + 9 + 2 + 5, 1)}},
      {lpddr5_6400, "tRRD_L", {activate(0, 0), activate(4, 4)}},
  };
}

TEST(JedecChecker, TakesWhatKeepsARuleToTheCycle) {
  for (const Case& c : cases()) {
    DramParameters parameters(c.device);
    if (&c.device == &lpddr5_6400) parameters.set("dram", "activate_cycles", "2");
    JedecChecker checker(parameters);
    for (const DramCommand& command : c.commands) checker.check(command);
    // The row cycle is longer than what is open and closed here.
    if (c.rule == "tRC") {
      EXPECT_EQ(checker.broken().count("tRC"), 0U);
      continue;
    }
    EXPECT_EQ(checker.report(), "") << c.rule;
  }
}

TEST(JedecChecker, FindsWhatIsACycleTooEarly) {
  for (const Case& c : cases()) {
    DramParameters parameters(c.device);
    if (&c.device == &lpddr5_6400) parameters.set("dram", "activate_cycles", "2");
    JedecChecker checker(parameters);
    std::vector<DramCommand> commands = c.commands;
    --commands.back().at;
    for (const DramCommand& command : commands) checker.check(command);
    // Four banks that share a group are closer than groups allow; "tCCD" of LPDDR3 is of one group.
    const bool found = checker.broken().count(c.rule) + checker.broken().count(c.rule + "_L") > 0;
    EXPECT_TRUE(found) << c.rule << ": " << checker.report();
  }
}

std::string rules_broken_by(const std::vector<DramCommand>& commands) {
  const DramParameters parameters(lpddr3_1600);
  JedecChecker checker(parameters);
  for (const DramCommand& command : commands) checker.check(command);
  std::string rules;
  for (const auto& broken : checker.broken()) rules += broken.first + ";";
  return rules;
}

TEST(JedecChecker, FindsCommandsForRowsThatAreNotThere) {
  EXPECT_EQ(rules_broken_by({read_command(10, 0)}), "row not open;");
  EXPECT_EQ(rules_broken_by({activate(0, 0, 7), read_command(20, 0, 8)}), "row not open;");
  EXPECT_EQ(rules_broken_by({activate(0, 0), precharge(40, 0), write_command(60, 0)}), "row not open;");
  EXPECT_EQ(rules_broken_by({activate(0, 0), activate(60, 0)}), "activate of an open bank;");
  EXPECT_EQ(rules_broken_by({activate(0, 0), refresh(60)}), "refresh of an open bank;");
  EXPECT_EQ(rules_broken_by({activate(0, 8)}), "no such bank;");
  EXPECT_EQ(rules_broken_by({activate(0, 0), {20, Kind::read, 0, 7, 128}}), "column beyond the row;");
}

TEST(JedecChecker, FindsRefreshesThatDoNotCome) {
  const DramParameters parameters(lpddr3_1600);
  constexpr Cycle interval = 3120;
  JedecChecker in_time(parameters);
  for (Cycle k = 1; k < 20; ++k) in_time.check(refresh(k * interval + 30));
  in_time.check_refreshes(20 * interval + 29);
  EXPECT_EQ(in_time.report(), "");
  in_time.check_refreshes(21 * interval);
  EXPECT_EQ(in_time.broken().count("tREFI"), 1U);
  JedecChecker too_slow(parameters);
  for (Cycle k = 1; k < 20; ++k) too_slow.check(refresh(k * (interval + 400)));
  EXPECT_EQ(too_slow.broken().count("tREFI"), 1U);
}

}  // namespace
}  // namespace vrpipe
