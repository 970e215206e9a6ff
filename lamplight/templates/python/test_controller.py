"""`python3 -m unittest` runs this, by a Python that has the package lamplight."""

import unittest

import lamplight


class {{Name}}Test(unittest.TestCase):
    def test_processes_and_one_loop_end_alike_though_packets_are_lost(self):
        def digest(engine):
            return lamplight.run("scenario.toml", duration=5, settings={"channel.loss": 0.3}, engine=engine).digest

        self.assertEqual(digest("processes"), digest("in-process"))

    def test_robots_gather_around_the_lamp(self):
        distance = lamplight.run("scenario.toml").summary["mean_lamp_distance_m"]
        self.assertLess(distance, 0.8)


if __name__ == "__main__":
    unittest.main()
