"""What modes, Campbell and SAFE diagrams share: travelling waves of a wheel, or a structure as a whole."""
