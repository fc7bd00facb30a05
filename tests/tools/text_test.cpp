#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

#include <vrpipe/component/error.h>

#include "cli/parse.h"
#include "host/progress_line.h"
#include "jobs/comparison.h"
#include "output/page_parts.h"
#include "output/report.h"
#include "output/text_table.h"

namespace vrpipe::tools {
namespace {

TEST(Text, GroupsDigits) {
  EXPECT_EQ(grouped(0), "0");
  EXPECT_EQ(grouped(999), "999");
  EXPECT_EQ(grouped(1000), "1,000");
  EXPECT_EQ(grouped(12345678), "12,345,678");
  EXPECT_EQ(grouped(~std::uint64_t{0}), "18,446,744,073,709,551,615");
}

TEST(Text, TablesAlign) {
  TextTable table({"", "one", "two"});
  table.group("group");
  table.row({"long label", "1", "22222"});
  table.row({"x", "333", "4"}, true);
  EXPECT_EQ(table.text({}),
            "              one    two\n"
            "------------------------\n"
            "group\n"
            "  long label    1  22222\n"
            "  x           333      4\n");
  TextStyle terminal;
  terminal.colors = true;
  EXPECT_NE(table.text(terminal).find("\x1b[32m"), std::string::npos);
}

TEST(Text, ColumnsOfTablesGoToTheLeftIfAsked) {
  TextTable table({"", "word", "number", "reason"});
  table.left(1);
  table.left(3);
  table.row({"a", "x", "1", "because"});
  table.row({"b", "longer", "22"});
  table.row({"c", "", "333", "no"});
  EXPECT_EQ(table.text({}),
            "     word    number  reason\n"
            "----------------------------\n"
            "  a  x            1  because\n"
            "  b  longer      22\n"
            "  c             333  no\n");
}

TEST(Text, LinesBreakBetweenWords) {
  using Lines = std::vector<std::string>;
  EXPECT_EQ(tools::wrapped("", 5), Lines{""});
  EXPECT_EQ(tools::wrapped("ab cd ef", 5), (Lines{"ab cd", "ef"}));
  EXPECT_EQ(tools::wrapped("ab cd ef", 4), (Lines{"ab", "cd", "ef"}));
  EXPECT_EQ(tools::wrapped("a longest b", 5), (Lines{"a", "longest", "b"}));
}

TEST(Text, TheLastColumnOfATableIsWrappedToItsWidth) {
  TextTable table({"", "number", "reason"});
  table.wrap(33);
  table.group("a group");
  table.row({"a", "1", "short"});
  table.row({"b", "22", "of more words than there is room for"});
  EXPECT_EQ(table.text({}),
            "     number  reason\n"
            "---------------------------------\n"
            "a group\n"
            "  a       1  short\n"
            "  b      22  of more words than\n"
            "             there is room for\n");
}

TEST(Text, LinesBelowARowAreAsWideAsTheyAreAskedToBe) {
  TextTable table({"", "n"});
  table.row({"a", "1"});
  table.below("of more words than there is room for", 26);
  table.row({"b", "22"});
  EXPECT_EQ(table.text({}),
            "      n\n"
            "-------\n"
            "  a   1\n"
            "      of more words than\n"
            "      there is room for\n"
            "  b  22\n");
}

TEST(Text, ProgressFitsItsLine) {
  const std::vector<std::string> names{"baseline", "qm", "het", "het+qm"};
  for (unsigned width : {10U, 50U, 79U, 200U}) {
    for (float done : {0.0F, 0.01F, 0.5F, 1.0F, 2.0F}) {
      EXPECT_LE(progress_text(names, {done, 0, done, 0}, 7200, width).size(), width);
    }
  }
  EXPECT_EQ(progress_text({"run"}, {0.5F}, 90, 40), "run  50%  [=========        ] 1:30 left");
  EXPECT_EQ(progress_text({"het", "het+qm"}, {0.0F, waiting}, 1, 30), "het   0%  het+qm waiting  ");
  // Of many, those under way.
  EXPECT_EQ(progress_text({"a", "b", "c", "d", "e"}, {1, 0.5F, 1, 0, 0}, 50, 46),
            "2/5  b  50%  [==========          ] 0:50 left");
}

/// A line of a terminal that wraps it anew when its width changes.
struct TerminalLine {
  unsigned width;
  std::string cells;
  std::size_t cursor = 0;

  void write(const std::string& bytes) {
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      if (bytes[i] == '\r') {
        cursor -= cursor % width;
      } else if (bytes.compare(i, 3, "\x1b[J") == 0) {
        cells.resize(cursor);
        i += 2;
      } else if (bytes.compare(i, 3, "\x1b[K") == 0) {
        const std::size_t row_end = std::min(cells.size(), cursor - cursor % width + width);
        std::fill(cells.begin() + static_cast<std::ptrdiff_t>(cursor),
                  cells.begin() + static_cast<std::ptrdiff_t>(row_end), ' ');
        i += 2;
      } else {
        cells.resize(std::max(cells.size(), cursor + 1));
        cells[cursor++] = bytes[i];
      }
    }
  }
};

TEST(Text, ProgressLeavesNothingOnATerminalThatShrinks) {
  const int terminal = ::posix_openpt(O_RDWR | O_NOCTTY);
  ASSERT_TRUE(terminal >= 0 && ::grantpt(terminal) == 0 && ::unlockpt(terminal) == 0);
  const int ours = ::open(::ptsname(terminal), O_RDWR | O_NOCTTY);
  const int stderr_before = ::dup(STDERR_FILENO);
  ::dup2(ours, STDERR_FILENO);
  const std::string term = std::getenv("TERM") == nullptr ? "" : std::getenv("TERM");
  ::setenv("TERM", "xterm", 1);
  TerminalLine line{0, {}};
  const auto resize = [&](unsigned short width) {
    winsize size{};
    size.ws_col = width;
    ::ioctl(terminal, TIOCSWINSZ, &size);
    line.width = width;
  };
  const auto catch_up = [&] {
    char bytes[1024];
    line.write(std::string(bytes, static_cast<std::size_t>(::read(terminal, bytes, sizeof bytes))));
    return line.cells;
  };
  std::vector<std::string> seen;
  {
    ProgressLine progress;
    resize(100);
    progress.show(std::string(200, 'x'));
    seen.push_back(catch_up());
    resize(30);
    progress.show("short");
    seen.push_back(catch_up());
    resize(3);
    progress.erase();
    seen.push_back(catch_up());
  }
  ::dup2(stderr_before, STDERR_FILENO);
  for (const int descriptor : {terminal, ours, stderr_before}) ::close(descriptor);
  term.empty() ? ::unsetenv("TERM") : ::setenv("TERM", term.c_str(), 1);
  EXPECT_EQ(seen, (std::vector<std::string>{std::string(99, 'x'), "short", ""}));
}

TEST(Text, WhatBoundsARunIsSaidWithItsParts) {
  RunResult run;
  run.request.variant = variant_named("baseline");
  run.request.platform = &platform_named("agx-orin-ideal-memory");
  EXPECT_EQ(bound_text(run), "");
  run.bottleneck = Bottleneck{"gpc0.crop", 0.998, {{"blend", 0.926}, {"sectors", 0.072}, {"forwarding", 0.0}}};
  EXPECT_EQ(bound_text(run), "baseline is bound by CROP, occupied 99.8 % (blend 92.6 %, sectors 7.2 %)\n");
  run.request.platform = &platform_named("desktop");
  EXPECT_EQ(bound_text(run), "baseline is bound by gpc0.CROP, occupied 99.8 % (blend 92.6 %, sectors 7.2 %)\n");
}

TEST(Text, WhereNoUnitIsAlwaysOccupiedTheNextIsNamedToo) {
  RunResult run;
  run.request.variant = variant_named("het");
  run.request.platform = &platform_named("agx-orin-ideal-memory");
  run.bottleneck = Bottleneck{"gpc0.raster", 0.76, {{"fine tiles", 0.76}}};
  run.units.resize(3);
  run.units[0] = {"gpc0.raster", {}, 0.76, {}};
  run.units[1] = {"gpc0.prop", {}, 0.3, {}};
  run.units[2] = {"gpc0.crop", {}, 0.756, {}};
  EXPECT_EQ(bound_text(run), "no one unit bounds het: RASTER is occupied 76.0 % (fine tiles 76.0 %), CROP 75.6 %\n");
}

TEST(Text, RatiosNeedBothRuns) {
  RunResult baseline;
  RunResult het;
  baseline.request.variant = variant_named("baseline");
  het.request.variant = variant_named("het");
  EXPECT_FALSE(speedup(baseline, het).has_value());
  baseline.cycles = 300;
  het.cycles = 100;
  EXPECT_FALSE(speedup(baseline, het).has_value()) << "nothing was drawn";
  baseline.counts.fragments_rasterized = 1;
  EXPECT_EQ(speedup(baseline, het), 3.0);
  EXPECT_FALSE(early_termination_ratio({baseline}).has_value());
  EXPECT_FALSE(early_termination_ratio({baseline, het}).has_value());
  baseline.counts.fragments_blended = 50;
  het.counts.fragments_blended = 20;
  EXPECT_EQ(early_termination_ratio({baseline, het}), 2.5);
}

TEST(Text, ParsesStrictly) {
  EXPECT_EQ(parse_number("-1.5e2", "--x"), -150);
  EXPECT_EQ(parse_number("+2", "--x"), 2);
  for (const char* text : {"", " 1", "1 ", "0x10", "nan", "inf", "1,5", "+-1", "1e999"}) {
    EXPECT_THROW(parse_number(text, "--x"), UserError) << text;
  }
  EXPECT_EQ(parse_triple("1,-2,3e1", "--x", "X,Y,Z", "0,0,0"), (Vec3{1, -2, 30}));
  const ImageSize size = parse_size("16384x1", "--size");
  EXPECT_EQ(size.width, 16384U);
  EXPECT_EQ(size.height, 1U);
  const Setting setting = parse_settings({"tc.bins=a=b.c"}).at(0);
  EXPECT_EQ(setting.unit, "tc");
  EXPECT_EQ(setting.parameter, "bins");
  EXPECT_EQ(setting.value, "a=b.c");
  for (const char* text : {"", "=", ".", ".=", "tc.=1", ".bins=1", "tc.bins=", "tc.bins", "tc=1"}) {
    EXPECT_THROW(parse_settings({text}), UserError) << text;
  }
  EXPECT_EQ(parse_unit_choices({"qru=mine"}).at(0).implementation, "mine");
  EXPECT_THROW(parse_unit_choices({"qru=mine", "qru=mine"}), UserError);
  EXPECT_THROW(parse_settings({"tc.bins=1", "tc.bins=2"}), UserError);
}

TEST(PageFigure, HasTheDataOfAPlotByItsWords) {
  BarPlot bars;
  bars.legend = {{"qm", "#0072b2"}};
  bars.groups = {{"a, b", {{0, 1.5, "#0072b2", "tip"}}, {2}}};
  const std::string html = figure("Speed-ups, by scene", bars);
  EXPECT_NE(html.find("download=\"speed-ups-by-scene.csv\""), std::string::npos) << html;
  const std::string csv = "group,series,from,to,note\n\"a, b\",qm,0,1.5,tip\n\"a, b\",mark,2,2,\n";
  EXPECT_NE(html.find(csv_link("speed-ups-by-scene", csv)), std::string::npos) << html;
  Plot plot;
  plot.x.title = "cycles";
  plot.y.title = "error, %";
  plot.points = {{1, 2, "#123456", Marker::square, false, "lt", "lt: 2 %"}};
  plot.legend = {{"front", "#123456", Marker::square, false, true}, {"het", "#123456", Marker::square, false, false}};
  EXPECT_NE(figure("x", plot).find(csv_link("x", "series,cycles,\"error, %\",label,note\nhet,1,2,lt,lt: 2 %\n")),
            std::string::npos);
}

}  // namespace
}  // namespace vrpipe::tools
