"""Which of seven punches is it? A policy that presses, looks as often as it was told, and answers."""

import gymnasium
import numpy as np

import mjtactile

SHAPES = mjtactile.INDENTER_NAMES
recognise = mjtactile.recognition.load("shape")  # a network that comes along


def play(env: gymnasium.Env, seed: int, looks: int) -> bool:
    """One episode; whether the answer was right."""
    press = np.array([0, 0, 0, 0.8, -1, *np.zeros(7)])  # stay, press with 0.8 N, do not answer yet
    env.reset(seed=seed)
    for _ in range(5):  # until the finger rests on the punch
        env.step(press)
    belief = np.zeros(len(SHAPES))
    for _ in range(looks):
        readings = env.step(press)[0]["tactile"][0]  # noisy: each look is another one
        belief += recognise(readings, among=SHAPES).probabilities
    answer = np.array([*press[:4], 1, *(belief == belief.max())])
    return env.step(answer)[-1]["success"]


env = gymnasium.make("mjtactile/PressIdentify-v0", observation="pascals", noise=0.1)
for looks in (1, 2, 4):
    right = sum(play(env, seed, looks) for seed in range(40))
    print(f"{looks} look(s): {right} of 40 right")
