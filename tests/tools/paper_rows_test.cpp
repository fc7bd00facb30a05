// Tests of the paper's rows as data, and of how numbers are judged.

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <vrpipe/component/error.h>

#include "jobs/paper_rows.h"
#include "jobs/reproduce_findings.h"
#include "jobs/reproduce_measures.h"

namespace vrpipe::testing {
namespace {

using tools::judge;
using tools::PaperRow;
using tools::Relation;
using tools::Verdict;

TEST(PaperRows, AreAllThereOnceInOrder) {
  std::vector<std::string> expected;
  for (int i = 1; i <= 32; ++i) expected.push_back("R" + std::to_string(i));
  for (int i = 1; i <= 13; ++i) expected.push_back("C" + std::to_string(i));
  std::vector<std::string> found, judged;
  for (const PaperRow& row : tools::paper_rows()) {
    found.push_back(row.id);
    if (row.is_judged()) judged.push_back(row.id);
    EXPECT_EQ(row.is_judged(), row.why.empty()) << row.id;
    EXPECT_EQ(row.tolerance_percent == PaperRow::default_tolerance_percent, row.tolerance_reason.empty()) << row.id;
  }
  EXPECT_EQ(found, expected);
  EXPECT_EQ(judged, (std::vector<std::string>{"R1",  "R2",  "R3",  "R4",  "R5",  "R6",  "R7",  "R8",  "R9", "R10",
                                              "R11", "R12", "R13", "R18", "R19", "R21", "R22", "R23", "C1", "C2",
                                              "C3",  "C4",  "C5",  "C6",  "C7",  "C8",  "C9",  "C10", "C11"}));
}

TEST(PaperRows, AreOfEveryQuantity) {
  std::string used;
  for (const PaperRow& row : tools::paper_rows()) {
    for (const std::string& measure : row.measures) used += measure + "\n";
    for (const tools::RowReason& reason : row.reasons) used += reason.measure + "\n";
    for (const tools::RowCondition& condition : row.holds) {
      used += condition.of + "\n";
      for (const std::string& than : condition.than) used += than + "\n";
    }
  }
  for (const tools::Quantity& quantity : tools::quantities()) {
    EXPECT_NE(used.find(quantity.name + "\n"), std::string::npos) << "no row is of " << quantity.name;
  }
}

TEST(PaperRows, PrintNumbersInTheirUnit) {
  EXPECT_EQ(tools::paper_row("R2").text(2.444), "2.44x");
  EXPECT_EQ(tools::paper_row("R5").text(2.608), "/2.61");
  EXPECT_EQ(tools::paper_row("R29").text(64), "64 warps");
}

TEST(PaperRows, NumbersAgreeUpToTheirTolerance) {
  EXPECT_EQ(judge(Relation::about, 2, 10, 2.2), Verdict::agrees);
  EXPECT_EQ(judge(Relation::about, 2, 10, 1.8), Verdict::agrees);
  EXPECT_EQ(judge(Relation::about, 2, 10, 2.2001), Verdict::differs);
  EXPECT_EQ(judge(Relation::about, 2, 10, 1.7999), Verdict::differs);
  EXPECT_EQ(judge(Relation::at_most, 100, 10, 110), Verdict::agrees);
  EXPECT_EQ(judge(Relation::at_most, 100, 10, 110.1), Verdict::differs);
  EXPECT_EQ(judge(Relation::at_most, 100, 10, 1), Verdict::agrees);
  EXPECT_EQ(judge(Relation::at_least, 64, 10, 57.6), Verdict::agrees);
  EXPECT_EQ(judge(Relation::at_least, 64, 10, 57.5), Verdict::differs);
  EXPECT_EQ(judge(Relation::above, 1.5, 10, 1.5), Verdict::differs);
  EXPECT_EQ(judge(Relation::above, 1.5, 10, 1.50001), Verdict::agrees);
}

TEST(PaperRows, NothingCanBeSaidOfWhatIsNoNumber) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Relation relation : {Relation::about, Relation::at_most, Relation::at_least, Relation::above}) {
    EXPECT_EQ(judge(relation, 2, 10, nan), Verdict::cannot_say);
  }
  EXPECT_EQ(judge(Relation::claim, 2, 10, 2), Verdict::cannot_say);
  EXPECT_FALSE(tools::difference_percent(2, nan).has_value());
  EXPECT_DOUBLE_EQ(tools::difference_percent(2, 3).value(), 50);
}

TEST(PaperRows, HaveTheRiddlesNumbers) {
  EXPECT_NEAR(tools::paper_fragment_fall_percent(), 24.6, 0.1);
  EXPECT_NEAR(tools::paper_het_efficiency(), 0.947, 0.001);
  EXPECT_NEAR(tools::paper_het_qm_efficiency(), 0.825, 0.001);
}

/// The shipped rows with one text replaced are refused: at the line of `at`, or of the text, with a message that has `parts`.
void refused(const std::string& from, const std::string& to, const std::vector<std::string>& parts,
             const std::string& at = "") {
  SCOPED_TRACE(to);
  std::string text = tools::shipped_rows_text();
  const std::size_t place = text.find(from);
  ASSERT_NE(place, std::string::npos);
  text.replace(place, from.size(), to);
  const auto end = text.begin() + static_cast<std::ptrdiff_t>(at.empty() ? place : text.find(at));
  const std::string line = fmt::format("(r.toml line {})", 1 + std::count(text.begin(), end, '\n'));
  try {
    static_cast<void>(tools::parse_rows(text, "r.toml"));
    FAIL() << "they are taken";
  } catch (const UserError& error) {
    const std::string message = error.what();
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    EXPECT_NE(message.find(line), std::string::npos) << message << " has not " << line;
    for (const std::string& part : parts) EXPECT_NE(message.find(part), std::string::npos) << message;
  }
}

TEST(PaperRows, MistakesNameTheLineAndWhatToDo) {
  const std::string first = "[[row]]";
  refused("vrpipe.paper-rows/1", "vrpipe.paper-rows/9", {"schema is not vrpipe.paper-rows/1"});
  refused("published = 2.78", "publishd = 2.78", {"unknown key 'publishd'", "did you mean published?"});
  refused("published = 2.78", "published = 0", {"published is 0"});
  refused("published = 2.78", "published = [2.78, 3]", {"'R1' has 2 published numbers and 1 measures"}, first);
  refused("published = 2.78", "", {"'R1' is to be judged", "published numbers or holds"}, first);
  refused("published = 2.78", "published = 2.78\ntolerance_percent = 10", {"'R1' has no tolerance_reason"}, first);
  refused("kind = \"measured\"", "kind = \"guessed\"", {"kind is 'guessed'", "measured, input, cannot fail"});
  refused("id = \"R2\"", "id = \"R1\"", {"there are two of R1"});
  refused("most speed-up of het+qm", "most speed-up of het-qm",
          {"nothing measures 'most speed-up of het-qm'", "did you mean most speed-up of het+qm?"});
  refused("tile-binning: bins", "tile-binning: bin", {"did you mean tile-binning: bins?"});
  refused("below = \"fall of fragments by het\"", "below = \"fall of fragment by het\"", {"there is no quantity"});
  refused(", below = \"fall of fragments by het\"", "", {"compares with nothing"}, "{ of = \"fall of quads by het\"");
  refused("row = \"R7\"", "row = \"R70\"", {"there is no row R70"});
  refused("setting = \"crop.forwarding=off\"", "setting = \"crop.forwarding=off\", row = \"R2\"",
          {"a reason is shown by one thing"}, "{ text = \"a CROP that waits");
  refused("\nhow = \"functional; views",
          "\nreason = [{ text = \"t\", setting = \"tc.bins=1\" }]\nhow = \"functional; views", {"four variants"},
          "reason = [{ text = \"t\"");
  refused("[[row]]", "[row", {"write TOML 1.0"});
}

}  // namespace
}  // namespace vrpipe::testing
