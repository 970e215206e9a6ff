"""A robot that drives towards the light and keeps away from others."""

import numpy as np

from lamplight import Command, Controller


class {{Name}}(Controller):
    def __init__(self, speed=0.1):
        self.speed = speed

    def step(self, percept):
        velocity = self.speed * percept.light.direction
        near = percept.neighbors[percept.neighbors["range_m"] < 0.25]
        away = -np.array([np.cos(near["bearing_rad"]), np.sin(near["bearing_rad"])]).sum(axis=1)
        return Command(velocity=velocity + 2 * self.speed * away)
