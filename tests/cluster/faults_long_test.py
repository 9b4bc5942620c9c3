"""The faults of faults_test.py, many times and for longer."""
import unittest

from tests.cluster import faults_test


class LongFaultsTest(faults_test.FaultsTest):
    node_kills, database_kills, outage_s = 100, 20, 30


if __name__ == "__main__":
    unittest.main()
