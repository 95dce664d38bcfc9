"""A camera that circles the world's origin for 20 s, and tells the ball where it is."""

import math
import time

import tessera

client = tessera.Client()  # TESSERA_ADDRESS, or port 7300 of this machine
for frame in range(600):
    angle = 0.02 * frame
    client.tell_program("ball::ball", x=2 * math.cos(angle), y=2 * math.sin(angle))
    time.sleep(1 / 30)
