// Lists in cells become columns; commands in a file of their own are paired by stamp.
#include "src/log/list_reader.h"

#include <cmath>

#include "tests/log/log_fixture.h"

namespace gapscope {
namespace {

constexpr const char* kState =
    "type,timestamp,positions,velocities\n"
    "STATE,100,\"[0.5, -1, 2e-3]\",\"[1, 2, 3]\"\n"
    "STATE,20100,\"[0.6, nan, 0]\",\"[4, 5, 6]\"\n"
    "\n"
    "STATE,40100,\"[0.7, -3, 1]\",\"[7, 8, 9]\"\n";
constexpr const char* kControl =
    "type,timestamp,positions\n"
    "CONTROL,150,\"[10, 20, 30]\"\n"
    "CONTROL,20100,\"[11, 21, 31]\"\n"
    "CONTROL,20200,\"[12, 22, 32]\"\n"
    "CONTROL,50000,\"[13, 23, 33]\"\n";

void ExpectColumn(const Log& log, const char* name, const std::vector<double>& values) {
  const Column* column = log.Find(name);
  ASSERT_NE(column, nullptr) << name;
  ASSERT_EQ(column->values.size(), values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isnan(values[i])) {
      EXPECT_TRUE(std::isnan(column->values[i])) << name << " " << i;
    } else {
      EXPECT_EQ(column->values[i], values[i]) << name << " " << i;
    }
  }
}

TEST(ListReaderTest, NamesOfJointsAndCommandsByTheirOwnStamps) {
  const TempFolder folder;
  const std::string path = folder.Write("state_motor.csv", kState);
  folder.Write("control.csv", kControl);
  folder.Write("joint_list.txt", "hip\r\nleft knee\nankle\n");
  const auto read = ReadLog(path, {});
  ASSERT_TRUE(read.ok()) << read.error().Text();
  const Log& log = read.value();
  EXPECT_EQ(log.format, "csv_lists");
  EXPECT_EQ(log.ColumnNames(), (std::vector<std::string>{"timestamp", "positions/hip", "positions/left knee",
                                                         "positions/ankle", "velocities/hip", "velocities/left knee",
                                                         "velocities/ankle", "control/positions/hip",
                                                         "control/positions/left knee", "control/positions/ankle"}));
  ExpectColumn(log, "positions/left knee", {-1, NAN, -3});
  ExpectColumn(log, "velocities/ankle", {3, 6, 9});
  // The last command at or before each row's stamp.
  ExpectColumn(log, "control/positions/hip", {NAN, 11, 12});
  EXPECT_EQ(log.Where(2), path + ":5");
  ASSERT_EQ(log.findings.size(), 1u);
  EXPECT_EQ(log.findings[0].column, "type");
}

TEST(ListReaderTest, TheFolderStandsForItsStateFile) {
  const TempFolder folder;
  folder.Write("run/state_motor.csv", kState);
  folder.Write("run/control.csv", kControl);
  const auto read = ReadLog(folder.Path("run"), {});
  ASSERT_TRUE(read.ok()) << read.error().Text();
  EXPECT_EQ(read.value().path, folder.Path("run/state_motor.csv"));
  ExpectColumn(read.value(), "control/positions[0]", {NAN, 11, 12});
  const auto none = ReadLog(folder.Path("."), {});
  EXPECT_FALSE(none.ok()) << "a folder without that file is no log";
}

TEST(ListReaderTest, NumbersWithoutNames) {
  const TempFolder folder;
  const auto read = ReadLog(folder.Write("run.csv", "time;q\n0;[1, 2]\n1;[3, 4]\n"), {});
  ASSERT_TRUE(read.ok()) << read.error().Text();
  ExpectColumn(read.value(), "q[0]", {1, 3});
  ExpectColumn(read.value(), "q[1]", {2, 4});
}

TEST(ListReaderTest, NumbersAloneStayAPlainCsv) {
  const TempFolder folder;
  const auto read = ReadLog(folder.Write("run.csv", "time,q\n0,1\n1,2\n"), {});
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read.value().format, "csv");
}

TEST(ListReaderTest, WhatDoesNotFitIsRefusedWithItsLine) {
  const TempFolder folder;
  const auto message = [&](const std::string& from, const std::string& to) {
    std::string text = kState;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    const auto read = ReadLog(folder.Write("state_motor.csv", text.replace(at, from.size(), to)), {});
    return read.ok() ? "read" : read.error().Text();
  };
  const auto expect = [](const std::string& text, const std::string& says) {
    EXPECT_NE(text.find(says), std::string::npos) << text;
  };
  const std::string shorter = message("[0.7, -3, 1]", "[0.7, -3]");
  expect(shorter, "state_motor.csv:5: positions: a list changes its length");
  expect(shorter, "2 numbers");
  expect(shorter, "3, as in the first row");
  expect(message("[0.6, nan, 0]", "[0.6, nan, 0, 0]"), "state_motor.csv:3: positions: a list changes its length");
  expect(message("[4, 5, 6]", "[4, five, 6]"), "state_motor.csv:3: velocities: not a number in a list");
  expect(message("[4, 5, 6]", "[4, 5, 6"), "state_motor.csv:3: velocities: a list without its ']'");
  expect(message("\"[4, 5, 6]\"", "4"), "state_motor.csv:3: velocities: not a list");
  expect(message("\"[4, 5, 6]\"", "1,2"), "state_motor.csv:3: wrong number of fields");
  folder.Write("joint_list.txt", "hip\nknee\n");
  expect(message("STATE,100", "STATE,101"), "state_motor.csv:2: the lists of 'positions' and joint_list.txt differ");
}

TEST(ListReaderTest, ABrokenControlFileIsNamed) {
  const TempFolder folder;
  const std::string path = folder.Write("state_motor.csv", kState);
  folder.Write("control.csv", "type,timestamp,positions\nCONTROL,1,\"[1, 2]\"\nCONTROL,2,\"[1]\"\n");
  const auto read = ReadLog(path, {});
  ASSERT_FALSE(read.ok());
  EXPECT_NE(read.error().Text().find("control.csv:3: positions: a list changes its length"), std::string::npos)
      << read.error().Text();
}

}  // namespace
}  // namespace gapscope
