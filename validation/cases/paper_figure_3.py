"""Fig. 3 of Maw, Barber & Fawcett (1981): psi_2 over psi_1 for the steel pucks."""

from validation.rebound_figure import INCH, ReboundFigure


class PaperFigure3(ReboundFigure):
    """Steel pucks of 3 in and 4 in, thrown at speeds a factor of three apart, obliquely or with backspin, by the law
    alone and inside MuJoCo and PyBullet, rebound along one curve: the annulus solution at the restitution of 0.93. The
    paper measured psi_2 below its elastic curve and says that 20 % more friction would explain this. If it means
    |psi_2|, that can hold only up to psi_1 of about 2.3, beyond which more friction has the opposite effect.
    Restitution explains none of the 20 %: in the whole range of partial stick it acts like a friction factor of about
    (1 + e)/2, and eq. (6) of the paper, which takes e = 1 and so finds mu too low, brings this factor back to 1.
    """

    place = 4
    title = "Paper, figure 3: rebound of the steel pucks"
    caption = (
        "psi_2 over psi_1 of the steel pucks. Hatched: where points would be plotted with mu up to 20 % too low; "
        "blue: with the +-2 % that the paper states for mu."
    )
    material = "steel"
    tolerance = 0.02
    diameters = {"3 in": 3.0 * INCH, "4 in": 4.0 * INCH}
    speeds = (0.5, 1.5)
    span = 7.0
    incidences = [0.25, 0.5, 1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 6.0]
