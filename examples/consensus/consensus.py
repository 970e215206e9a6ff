"""Robots that agree on the highest of their proposals, and a mistake that is easily made."""

import lamplight
from lamplight import Command, Controller

CONFIRMATIONS = 20
"""Cycles in which a robot must have heard its own value from somebody before it decides for it."""


class Consensus(Controller):
    """Proposes its number, says the highest proposal that it knows, and decides for it once that is confirmed.

    A payload is two bytes: the value, and 1 if it is decided. A decision is final, and whoever hears of one joins it.
    """

    def __init__(self, hasty=True):
        self.hasty = hasty
        self.value, self.decided = self.robot, False
        self.cycles = self.confirmed = 0

    def boot(self):
        return self.say()

    def step(self, percept):
        now = percept.neighbors["age_cycles"] == 0
        heard = [tuple(payload) for payload, is_new in zip(percept.payloads, now) if is_new]
        decisions = {value for value, decided in heard if decided}
        if not self.decided:
            self.listen([value for value, _ in heard], decisions)
        else:
            lamplight.always(decisions <= {self.value}, "nobody decides otherwise")
        lamplight.sometimes(self.decided, "a robot decides")
        lamplight.sometimes(self.decided and self.life > 1, "a restarted robot decides")
        return self.say()

    def listen(self, values, decisions):
        before, self.cycles = self.value, self.cycles + 1
        self.value = max(decisions or [self.value, *values])
        self.confirmed = self.confirmed + (self.value in values) if self.value == before else 0
        self.decided = bool(decisions) or self.confirmed >= CONFIRMATIONS
        # The mistake: whoever comes back finds a swarm that has decided long ago, and hears of that at once. Or not?
        if self.hasty and self.life > 1 and self.cycles >= 3:
            self.decided = True

    def say(self):
        return Command(payload=bytes([self.value, self.decided]))
