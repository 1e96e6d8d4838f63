"""An environment for goals of every kind."""

TABLE = """
<mujoco>
  <option timestep="0.002" integrator="implicitfast"/>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 0.05" priority="1"/>
    <site name="mount" pos="0 0 0.5" euler="180 0 0"/>
    <site name="hook" pos="0.2 0.1 0.3"/>
    <body name="cart" pos="0.3 0 0.1">
      <joint name="rail" type="slide" axis="1 0 0" damping="1"/>
      <geom name="cart" type="box" size="0.05 0.05 0.05" mass="0.2" priority="1"/>
      <body name="flag" pos="0 0 0.06"><geom name="flag" size="0.01" mass="0.01" priority="1"/></body>
    </body>
    <body name="ball" pos="-0.3 0 0.03">
      <freejoint name="ball_free"/>
      <geom name="ball" size="0.03" mass="0.05" priority="1"/>
    </body>
    <body name="post" pos="0 0.3 0.1"><geom name="post" size="0.03" priority="1"/></body>
  </worldbody>
</mujoco>"""
