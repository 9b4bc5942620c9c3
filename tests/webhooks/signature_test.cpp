/// Signatures according to Standard Webhooks.

#include <gtest/gtest.h>

#include "server/webhooks/webhooks.h"

using namespace webhooks;

namespace {

const std::string secret_text = "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw";

std::string whsec(const std::string& base64) { return "whsec_" + base64; }

}  // namespace

TEST(Signature, MatchesTheReferenceLibraries) {
  // From the tests of the libraries of standardwebhooks.com.
  const auto secrets = read_secrets(secret_text);
  ASSERT_TRUE(secrets) << secrets.error();
  EXPECT_EQ(signature(*secrets, "msg_p5jXN8AQM9LWM0D4loKWxJek", 1614265330, R"({"test": 2432232314})"),
            "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE=");
}

TEST(Signature, HasOneValueForEachSecret) {
  const std::string other = whsec(std::string(32, 'A'));
  const auto both = read_secrets(secret_text + "\n" + other + "\n");
  ASSERT_TRUE(both);
  EXPECT_EQ(signature(*both, "a", 1, "b"),
            signature(*read_secrets(secret_text), "a", 1, "b") + " " + signature(*read_secrets(other), "a", 1, "b"));
}

TEST(Signature, DependsOnEverythingItCovers) {
  const auto secrets = *read_secrets(secret_text);
  const std::string whole = signature(secrets, "id", 12, "body");
  EXPECT_NE(whole, signature(secrets, "ie", 12, "body"));
  EXPECT_NE(whole, signature(secrets, "id", 13, "body"));
  EXPECT_NE(whole, signature(secrets, "id", 12, "bodz"));
}

TEST(ReadSecrets, Requires24To64BytesInBase64) {
  EXPECT_EQ(read_secrets(whsec(std::string(32, 'A')))->front(), std::string(24, '\0'));
  EXPECT_EQ(read_secrets(whsec(std::string(84, 'A') + "AA=="))->front(), std::string(64, '\0'));
  for (const std::string& text :
       {std::string(), std::string(" \n"), std::string("whsec_"), secret_text.substr(6), whsec(std::string(31, 'A')),
        whsec(std::string(28, 'A') + "AAA="), whsec(std::string(84, 'A') + "AAA="), whsec(std::string(31, 'A') + "!"),
        whsec(std::string(32, 'A') + "AB=="), whsec(std::string(400, 'A')), secret_text + " other"}) {
    const auto secrets = read_secrets(text);
    ASSERT_FALSE(secrets) << text;
    EXPECT_EQ(secrets.error().find("AAAA"), std::string::npos) << "a secret in a sentence: " << secrets.error();
  }
}
