"""Fig. 5 of Maw, Barber & Fawcett (1981): psi_2 over psi_1 for the rubber puck."""

from validation.rebound_figure import INCH, ReboundFigure


class PaperFigure5(ReboundFigure):
    """A rubber puck, whose contact point meets the block at angles up to 87 degrees, rebounds along the annulus
    solution at the restitution of 0.86, at speeds a factor of three apart, by the law alone and inside MuJoCo and
    PyBullet. Here too restitution explains none of the 20 % of friction that the paper misses: in the whole range of
    partial stick it acts like a factor of about (1 + e)/2, and eq. (6) brings this back to 1. Only up to psi_1 of about
    1.6 does restitution lower |psi_2| as too little friction would, and then along a different curve.
    """

    place = 6
    title = "Paper, figure 5: rebound of the rubber puck"
    caption = (
        "psi_2 over psi_1 of the rubber puck. Hatched: where points would be plotted with mu up to 20 % too low; "
        "blue: with the +-25 % that the paper states for mu."
    )
    material = "rubber"
    tolerance = 0.25
    diameters = {"4 in": 4.0 * INCH}
    speeds = (0.3, 0.9)
    span = 6.5
    incidences = [0.25, 0.5, 1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0]
