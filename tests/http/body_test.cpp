#include "server/http/body.h"

#include <gtest/gtest.h>

#include <utility>

namespace {

class BodyTest : public testing::Test {
 protected:
  BodyTest() {
    budget.directory = testing::TempDir();
    budget.body_memory_bytes = 8;
    budget.memory_bytes = 12;
    budget.file_bytes = 40;
  }
  http::BodyBudget budget;
};

TEST_F(BodyTest, KeepsShortBodiesInMemory) {
  http::Body body(budget);
  EXPECT_TRUE(body.append("abc"));
  EXPECT_TRUE(body.append("defgh"));
  EXPECT_FALSE(body.spooled());
  EXPECT_EQ(body.take(), "abcdefgh");
}

TEST_F(BodyTest, SpoolsLongBodiesToAFile) {
  http::Body body(budget);
  EXPECT_TRUE(body.append("abcdefgh"));
  EXPECT_TRUE(body.append("i"));
  EXPECT_TRUE(body.spooled());
  EXPECT_TRUE(body.append(std::string(20, 'j')));
  EXPECT_EQ(body.take(), "abcdefghi" + std::string(20, 'j'));
}

TEST_F(BodyTest, ReadsAnyPartFromMemoryAndFile) {
  for (const std::string& bytes : {std::string("abcdefgh"), std::string("abcdefghijklmnopqrst"), std::string()}) {
    http::Body body(budget);
    ASSERT_TRUE(body.append(bytes));
    EXPECT_EQ(body.spooled(), bytes.size() > 8);
    for (std::size_t at = 0; at <= bytes.size() + 1; ++at) {
      std::string part(5, '?');
      part.resize(body.read(at, part.data(), part.size()));
      EXPECT_EQ(part, at < bytes.size() ? bytes.substr(at, 5) : "") << at << " of " << bytes.size();
    }
    EXPECT_EQ(body.take(), bytes) << "reading leaves the body unchanged";
  }
}

TEST_F(BodyTest, SpoolsShortBodiesIfTheSharedMemoryIsUsed) {
  http::Body first(budget), second(budget);
  EXPECT_TRUE(first.append("abcdefgh"));
  EXPECT_TRUE(second.append("abcde"));
  EXPECT_FALSE(first.spooled());
  EXPECT_TRUE(second.spooled());
  EXPECT_EQ(second.take(), "abcde");
}

TEST_F(BodyTest, RefusesBodiesBeyondTheFileBudget) {
  http::Body first(budget), second(budget);
  EXPECT_TRUE(first.append(std::string(30, 'a')));
  EXPECT_FALSE(second.append(std::string(11, 'b')));
}

TEST_F(BodyTest, RefusesBodiesIfNoFileCanBeCreated) {
  budget.directory = "/nonexistent";
  http::Body body(budget);
  EXPECT_FALSE(body.append(std::string(9, 'a')));
}

TEST_F(BodyTest, ReleasesItsBudgetWhenTakenMovedOrDestroyed) {
  {
    http::Body memory(budget), file(budget), dropped(budget);
    EXPECT_TRUE(memory.append("abc"));
    EXPECT_TRUE(file.append("123456789"));
    EXPECT_TRUE(dropped.append("x"));
    http::Body moved = std::move(file);
    EXPECT_EQ(budget.memory_used, 4U);
    EXPECT_EQ(budget.file_used, 9U);
    EXPECT_EQ(moved.take(), "123456789");
    EXPECT_EQ(budget.file_used, 0U);
    dropped = std::move(memory);
    EXPECT_EQ(budget.memory_used, 3U);
  }
  EXPECT_EQ(budget.memory_used, 0U);
  EXPECT_EQ(budget.file_used, 0U);
}

}  // namespace
