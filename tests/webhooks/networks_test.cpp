/// The addresses that webhooks may reach.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>

#include "server/webhooks/webhook_sender.h"

using namespace webhooks;

namespace {

Address address(const std::string& text) {
  sockaddr_in v4{};
  sockaddr_in6 v6{};
  if (inet_pton(AF_INET, text.c_str(), &v4.sin_addr) == 1) {
    v4.sin_family = AF_INET;
    return address_of(reinterpret_cast<const sockaddr*>(&v4), sizeof v4).value();
  }
  EXPECT_EQ(inet_pton(AF_INET6, text.c_str(), &v6.sin6_addr), 1) << text;
  v6.sin6_family = AF_INET6;
  return address_of(reinterpret_cast<const sockaddr*>(&v6), sizeof v6).value();
}

}  // namespace

TEST(IsPublic, AcceptsGlobalAddresses) {
  for (const char* text :
       {"1.1.1.1", "9.255.255.255", "11.0.0.0", "100.63.255.255", "100.128.0.0", "128.0.0.1", "169.253.255.255",
        "172.15.255.255", "172.32.0.0", "192.0.1.0", "192.167.255.255", "198.17.255.255", "198.20.0.0",
        "223.255.255.255", "2606:4700::1111", "2a00::1", "2001:200::1", "3ffe::1"})
    EXPECT_TRUE(is_public(address(text))) << text;
}

TEST(IsPublic, RejectsSpecialPurposeAddresses) {
  for (const char* text :
       {"0.0.0.0",     "0.255.255.255",   "10.0.0.0",         "10.255.255.255",  "100.64.0.0",      "100.127.255.255",
        "127.0.0.1",   "127.255.255.255", "169.254.169.254",  "172.16.0.0",      "172.31.255.255",  "192.0.0.1",
        "192.0.2.1",   "192.88.99.1",     "192.168.0.1",      "198.18.0.0",      "198.19.255.255",  "198.51.100.7",
        "203.0.113.7", "224.0.0.1",       "239.255.255.255",  "240.0.0.1",       "255.255.255.255", "::",
        "::1",         "::7f00:1",        "::ffff:127.0.0.1", "::ffff:10.0.0.1", "64:ff9b::7f00:1", "100::1",
        "2001::1",     "2001:1ff:ffff::", "2001:db8::1",      "2002:7f00:1::",   "3fff::1",         "fc00::1",
        "fd00::1",     "fe80::1",         "fec0::1",          "ff02::1",         "4000::1"})
    EXPECT_FALSE(is_public(address(text))) << text;
}

TEST(IsPublic, TreatsMappedAddressesAsIpv4) {
  EXPECT_TRUE(is_public(address("::ffff:1.1.1.1")));
  EXPECT_EQ(text_of(address("::ffff:1.1.1.1")), "1.1.1.1");
  EXPECT_EQ(text_of(address("2606:4700::1111")), "2606:4700::1111");
}

TEST(AddressOf, ReturnsNoneForOtherFamilies) {
  sockaddr unix_socket{};
  unix_socket.sa_family = AF_UNIX;
  EXPECT_EQ(address_of(&unix_socket, sizeof unix_socket), std::nullopt);
  sockaddr_in6 v6{};
  v6.sin6_family = AF_INET6;
  EXPECT_EQ(address_of(reinterpret_cast<const sockaddr*>(&v6), sizeof(sockaddr_in)), std::nullopt);
}

TEST(Networks, AllowExactlyTheirAddresses) {
  const auto networks = Networks::parse("127.0.0.0/8, 10.1.2.3 ,192.168.7.128/25,fd12:3456::/33");
  ASSERT_TRUE(networks) << networks.error();
  for (const char* text : {"127.0.0.1", "127.255.255.255", "10.1.2.3", "192.168.7.128", "192.168.7.255",
                           "::ffff:127.0.0.1", "fd12:3456:7fff::1", "1.1.1.1"})
    EXPECT_TRUE(networks->allow(address(text))) << text;
  for (const char* text : {"10.1.2.2", "10.1.2.4", "192.168.7.127", "fd12:3456:8000::1", "::1", "169.254.169.254"})
    EXPECT_FALSE(networks->allow(address(text))) << text;
}

TEST(Networks, MayBeEmpty) {
  for (const char* text : {"", " "}) {
    const auto networks = Networks::parse(text);
    ASSERT_TRUE(networks);
    EXPECT_FALSE(networks->allow(address("127.0.0.1")));
  }
  EXPECT_TRUE(Networks::parse("0.0.0.0/0")->allow(address("127.0.0.1")));
  EXPECT_FALSE(Networks::parse("0.0.0.0/0")->allow(address("::1")));
  EXPECT_TRUE(Networks::parse("::/0")->allow(address("127.0.0.1")));
}

TEST(Networks, RejectsInvalidText) {
  for (const char* text : {"localhost", "10.0.0.0/33", "10.0.0.0/-1", "::/129", "10.0.0.0/8x", "10.0.0/8", "10.0.0.0/",
                           "10.0.0.0/8,,::1", "10.0.0.0 /8"})
    EXPECT_FALSE(Networks::parse(text)) << text;
}
