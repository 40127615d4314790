// Shaders of the q3rays show-case map. Made by the generator in src/content: edit there.

textures/showcase/light_coffer
{
	surfaceparm nomarks
	surfaceparm nodlight
	q3map_surfacelight 7000
	{
		map textures/showcase/lamp_warm.png
		rgbGen identity
	}
}

textures/showcase/light_sconce
{
	surfaceparm nomarks
	surfaceparm nodlight
	q3map_surfacelight 7000
	{
		map textures/showcase/lamp_warm.png
		rgbGen identity
	}
}

textures/showcase/light_strip
{
	surfaceparm nomarks
	surfaceparm nodlight
	q3map_surfacelight 5500
	{
		map textures/showcase/lamp_cool.png
		rgbGen identity
	}
}

textures/showcase/light_hall
{
	surfaceparm nomarks
	surfaceparm nodlight
	q3map_surfacelight 4000
	{
		map textures/showcase/lamp_white.png
		rgbGen identity
	}
}

textures/showcase/light_cellar
{
	surfaceparm nomarks
	surfaceparm nodlight
	q3map_surfacelight 16000
	{
		map textures/showcase/lamp_amber.png
		rgbGen identity
	}
}

textures/showcase/light_red
{
	surfaceparm nomarks
	surfaceparm nodlight
	q3map_surfacelight 9000
	{
		map textures/showcase/lamp_red.png
		rgbGen identity
	}
}

textures/showcase/light_teal
{
	surfaceparm nomarks
	surfaceparm nodlight
	q3map_surfacelight 7000
	{
		map textures/showcase/lamp_teal.png
		rgbGen identity
	}
}

textures/showcase/light_amber
{
	surfaceparm nomarks
	surfaceparm nodlight
	q3map_surfacelight 7000
	{
		map textures/showcase/lamp_amber.png
		rgbGen identity
	}
}

textures/showcase/light_violet
{
	surfaceparm nomarks
	surfaceparm nodlight
	q3map_surfacelight 10000
	{
		map textures/showcase/lamp_violet.png
		rgbGen identity
	}
}

textures/showcase/ember
{
	surfaceparm nomarks
	surfaceparm nodlight
	q3map_surfacelight 3500
	{
		map textures/showcase/ember.png
		rgbGen identity
	}
}

textures/showcase/sky
{
	surfaceparm sky
	surfaceparm noimpact
	surfaceparm nolightmap
	surfaceparm nodlight
	q3map_sunExt 1 0.86 0.62 800 250 50 0.5 16
	q3map_surfacelight 900
	skyparms env/showcase 512 -
}

textures/showcase/grate
{
	surfaceparm trans
	surfaceparm alphashadow
	surfaceparm nomarks
	cull none
	{
		map textures/showcase/grate.png
		alphaFunc GE128
		depthWrite
		rgbGen identity
	}
}

textures/showcase/glass
{
	surfaceparm trans
	surfaceparm nolightmap
	surfaceparm nomarks
	cull none
	rt_ior 1.5
	{
		map $whiteimage
		blendFunc filter
		rgbGen const ( 0.95 0.985 0.97 )
	}
}

textures/showcase/mirror
{
	surfaceparm nolightmap
	surfaceparm nomarks
	portal
	{
		map $whiteimage
		blendFunc filter
		rgbGen const ( 0.97 0.97 0.97 )
		depthWrite
	}
}
